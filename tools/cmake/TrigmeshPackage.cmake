# The Debian package: cmake --build build/release --target package

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME trigmesh)
set(CPACK_PACKAGE_VENDOR "Trigmesh")
set(CPACK_PACKAGE_CONTACT "Trigmesh maintainers <maintainers@trigmesh.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "camera-to-model firmware for handheld rigs")
set(CPACK_PACKAGE_DESCRIPTION "Press the trigger, get a mesh: a service that takes pictures with a camera of the board and
makes camera poses, a coloured point cloud and a textured mesh of them, on the board
itself; and the same for photographs on the command line.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd, udev, init-system-helpers")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libcamera-ipa")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "ffmpeg")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(package_folder "${CMAKE_SOURCE_DIR}/tools/package")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    "${package_folder}/conffiles;${package_folder}/postinst;${package_folder}/prerm;${package_folder}/postrm")

install(FILES README.md CHANGELOG.md DESTINATION /usr/share/doc/trigmesh)
install(FILES "${package_folder}/copyright" DESTINATION /usr/share/doc/trigmesh)

include(CPack)
