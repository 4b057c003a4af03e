# Precompiled headers, which spare a good part of the compiling. They hold only what nearly every source that uses them
# includes anyway, so that a source that forgets an include is still found; -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
# -DTENDRIL_UNITY=OFF finds every one.
# tendril_add_precompiled(NAME HEADERS... [LIBS libraries...]): a target for others to REUSE_FROM. It links with little, since
# GCC wants every macro defined here to be defined there, too.
function(tendril_add_precompiled NAME)
  cmake_parse_arguments(PRECOMPILED "" "" "LIBS" ${ARGN})
  file(CONFIGURE OUTPUT ${NAME}.cpp CONTENT "")
  add_library(${NAME} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${NAME}.cpp)
  target_link_libraries(${NAME} PRIVATE tendril_options tendril_warnings Eigen3::Eigen ${PRECOMPILED_LIBS})
  # what base.h includes
  target_precompile_headers(${NAME} PRIVATE <Eigen/Dense> <filesystem> <random> <string> <vector>
                                            ${PRECOMPILED_UNPARSED_ARGUMENTS})
endfunction()

# tendril_use_precompiled(TARGET PREFIX MODULE): TARGET uses PREFIX, or PREFIX_json if MODULE works with solution.h,
# benchmark.h or scenario/document.h.
function(tendril_use_precompiled TARGET PREFIX MODULE)
  if(MODULE MATCHES "^(scenario|solution|planner|verification|viewer|benchmark)$")
    string(APPEND PREFIX _json)
  endif()
  target_precompile_headers(${TARGET} REUSE_FROM ${PREFIX})
endfunction()
