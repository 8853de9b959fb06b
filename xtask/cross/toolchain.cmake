# CMake for another platform: UPT_CROSS_PREFIX is the compiler's, UPT_CROSS_RUN what runs its programs here.
if(DEFINED ENV{UPT_CROSS_SYSTEM})
  set(CMAKE_SYSTEM_NAME "$ENV{UPT_CROSS_SYSTEM}")
  set(CMAKE_SYSTEM_PROCESSOR "$ENV{UPT_CROSS_PROCESSOR}")
  set(CMAKE_C_COMPILER "$ENV{UPT_CROSS_PREFIX}gcc")
  set(CMAKE_CXX_COMPILER "$ENV{UPT_CROSS_PREFIX}g++")
  set(CMAKE_CROSSCOMPILING_EMULATOR "$ENV{UPT_CROSS_RUN}")
  set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
  # The compilers' own libraries inside: nothing but the system's and ours is needed beside a program.
  set(CMAKE_EXE_LINKER_FLAGS_INIT "-static-libgcc -static-libstdc++")
  if(CMAKE_SYSTEM_NAME STREQUAL "Windows")
    set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
  endif()
endif()
