# OpenCV by module. Debian's OpenCVConfig.cmake comes only with the package libopencv-dev, which drags in every module
# (GDAL, FFmpeg, Qt); the -dev packages of the single modules have headers and libraries but no CMake files.
# highgui, imgcodecs and videoio are left out on purpose: they never enter the firmware.

find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)

function(trigmesh_import_opencv module)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  add_library(opencv_${module} SHARED IMPORTED GLOBAL)
  set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}")
  # SYSTEM: OpenCV's headers warn under C++20.
  target_include_directories(opencv_${module} SYSTEM INTERFACE "${OPENCV_INCLUDE_DIR}")
  target_link_libraries(opencv_${module} INTERFACE ${ARGN})
endfunction()

trigmesh_import_opencv(core)
trigmesh_import_opencv(imgproc opencv_core)
trigmesh_import_opencv(flann opencv_core)
trigmesh_import_opencv(features2d opencv_imgproc opencv_flann)
trigmesh_import_opencv(calib3d opencv_features2d)
