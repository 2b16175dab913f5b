# cmake -DBUILD=<build folder> -DWORK=<scratch folder> -DCXX=<compiler> -P run.cmake
# Installs the build, builds the consumer against what was installed and nothing else, and runs both.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code STREQUAL "0")
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${code}:\n${out}")
  endif()
  set(out "${out}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -G Ninja -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
message(STATUS "consumer: ${out}")

run(${WORK}/prefix/bin/skylight --version)
message(STATUS "${out}")
run(${WORK}/prefix/bin/skylight evaluate --help)
# The same layout from another place: nothing in it may point back to the build or the prefix.
file(RENAME ${WORK}/prefix ${WORK}/moved)
run(${WORK}/moved/bin/skylight --version)
foreach(needed web/index.html service/openapi.json sim/scenarios/straight.json sim/scenario.schema.json skylight.schema.json)
  if(NOT EXISTS ${WORK}/moved/share/skylight/${needed})
    message(FATAL_ERROR "share/skylight/${needed} is not installed")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
