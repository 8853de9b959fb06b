# The release archive: a shared library with a C ABI, the same for debug and release builds. archives.cmake has addresses and hashes.
include("${CMAKE_CURRENT_LIST_DIR}/archives.cmake")
if(NOT UPT_ARCHIVE)
    message(FATAL_ERROR "libupt has no archive for this triplet")
endif()
vcpkg_check_linkage(ONLY_DYNAMIC_LIBRARY)

vcpkg_download_distfile(ARCHIVE
    URLS "${UPT_ADDRESS}/${UPT_ARCHIVE}"
    FILENAME "${UPT_ARCHIVE}"
    SHA512 "${UPT_SHA512}"
)
vcpkg_extract_source_archive(SOURCE_PATH ARCHIVE "${ARCHIVE}")

file(INSTALL "${SOURCE_PATH}/include/upt.h" "${SOURCE_PATH}/include/upt.hpp" DESTINATION "${CURRENT_PACKAGES_DIR}/include")
file(GLOB libraries "${SOURCE_PATH}/lib/lib*.so*")
foreach(folder IN ITEMS lib debug/lib)
    if(folder STREQUAL "lib" OR NOT VCPKG_BUILD_TYPE STREQUAL "release")
        file(INSTALL ${libraries} DESTINATION "${CURRENT_PACKAGES_DIR}/${folder}")
    endif()
endforeach()

# find_package(upt) from where vcpkg keeps such files.
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/upt-config.cmake" DESTINATION "${CURRENT_PACKAGES_DIR}/share/upt")
file(INSTALL "${SOURCE_PATH}/lib/cmake/upt/upt-config-version.cmake" DESTINATION "${CURRENT_PACKAGES_DIR}/share/upt")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/libupt")
set(doc "${SOURCE_PATH}/share/doc/upt")
vcpkg_install_copyright(FILE_LIST "${doc}/LICENSE-APACHE" "${doc}/LICENSE-MIT" "${doc}/NOTICE" "${doc}/THIRD-PARTY.txt" "${doc}/onnxruntime/LICENSE")
