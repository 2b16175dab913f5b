# Compiler options of the whole tree: one interface target, linked by every target of ours.
add_library(skylight_options INTERFACE)
target_compile_features(skylight_options INTERFACE cxx_std_20)
target_compile_options(skylight_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                                                  -Wold-style-cast -Woverloaded-virtual)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(skylight_options INTERFACE -Wno-restrict)  # false for "text" + std::string (GCC bug 105329)
endif()
# Designated initializers name what differs from the defaults; the rest is meant to be left out.
target_compile_options(skylight_options INTERFACE -Wno-missing-field-initializers)
if(SKYLIGHT_WARNINGS_AS_ERRORS)
  target_compile_options(skylight_options INTERFACE -Werror)
endif()

# The same figures from g++ and clang, and from one machine to the next: no contraction to fused
# multiply-add that only some processors have.
target_compile_options(skylight_options INTERFACE -ffp-contract=off)

if(SKYLIGHT_SANITIZE)
  add_compile_options(-fsanitize=${SKYLIGHT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1)
  add_link_options(-fsanitize=${SKYLIGHT_SANITIZE})
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # base_dir and no hash_dir: a clone in another folder finds what an earlier one compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${CCACHE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fpch-preprocess)
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:SHELL:-Xclang -fno-pch-timestamp>")
  endif()
endif()

# One precompiled header for all targets that take OpenCV and Eigen.
function(skylight_precompile target)
  if(NOT TARGET skylight_pch)
    file(WRITE ${CMAKE_BINARY_DIR}/skylight_pch.cpp "")
    add_library(skylight_pch OBJECT ${CMAKE_BINARY_DIR}/skylight_pch.cpp)
    target_link_libraries(skylight_pch PRIVATE skylight_options skylight::types)
    target_precompile_headers(skylight_pch PRIVATE <chrono> <functional> <memory> <optional> <string> <vector>
                              <Eigen/Core> <Eigen/Geometry> <opencv2/core.hpp> <opencv2/imgproc.hpp>)
  endif()
  target_precompile_headers(${target} REUSE_FROM skylight_pch)
  target_compile_options(${target} PRIVATE -fPIC)  # programs' -fPIE would not go with the header's -fPIC
endfunction()
