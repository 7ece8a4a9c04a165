# Everything that is linked comes from Debian; the names of the packages stand in tools/setup/packages.txt.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
# Only these modules: highgui, imgcodecs and videoio never enter the firmware.
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc features2d calib3d flann)
find_package(Ceres 2.1 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(PNG REQUIRED)
find_package(tl-expected REQUIRED)
pkg_check_modules(HWY REQUIRED IMPORTED_TARGET libhwy)
pkg_check_modules(TURBOJPEG REQUIRED IMPORTED_TARGET libturbojpeg)
pkg_check_modules(EXIF REQUIRED IMPORTED_TARGET libexif)
pkg_check_modules(TOMLPP REQUIRED IMPORTED_TARGET tomlplusplus)

# OpenCV's own headers warn under C++20; imported targets are SYSTEM.
if(TRIGMESH_BUILD_TESTS)
  find_package(GTest REQUIRED)
  include(GoogleTest)
endif()
if(TRIGMESH_BUILD_BENCH)
  find_package(benchmark REQUIRED)
endif()
