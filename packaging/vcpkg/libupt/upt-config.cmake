# Target upt::upt, the shared library.
if(NOT TARGET upt::upt)
    get_filename_component(upt_prefix "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)
    add_library(upt::upt SHARED IMPORTED)
    set_target_properties(upt::upt PROPERTIES
        IMPORTED_CONFIGURATIONS "RELEASE"
        IMPORTED_LOCATION_RELEASE "${upt_prefix}/lib/libupt.so"
        IMPORTED_LOCATION "${upt_prefix}/lib/libupt.so"
        INTERFACE_INCLUDE_DIRECTORIES "${upt_prefix}/include")
    if(EXISTS "${upt_prefix}/debug/lib/libupt.so")
        set_property(TARGET upt::upt APPEND PROPERTY IMPORTED_CONFIGURATIONS DEBUG)
        set_target_properties(upt::upt PROPERTIES IMPORTED_LOCATION_DEBUG "${upt_prefix}/debug/lib/libupt.so")
    endif()
    unset(upt_prefix)
endif()
