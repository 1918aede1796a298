# Installs the runtime, builds the consumers against it, by CMake and by pkg-config, and runs them.
# Takes BUILD (of Rebounce), WORK (a folder of its own), SOURCE (this one), PROGRAM (rebounce),
# SCENE, GENERATOR, C_COMPILER and CXX_COMPILER; with ROOT (Rebounce's) the runtime is first built
# without Embree and OpenMP, and BUILD is not used.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    string(REPLACE ";" " " line "${ARGN}")
    message(FATAL_ERROR "${line}: ${status}\n${text}")
  endif()
  message(STATUS "${text}")
endfunction()

file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/installed)
set(file ${WORK}/box.safetensors)
if(ROOT)
  set(BUILD ${WORK}/rebounce)
  run(${CMAKE_COMMAND} -S ${ROOT} -B ${BUILD} -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX_COMPILER}
      -DCMAKE_BUILD_TYPE=Release -DREBOUNCE_WITH_EMBREE=OFF -DREBOUNCE_WITH_OPENMP=OFF
      -DREBOUNCE_BUILD_PRECOMPUTE=OFF
      -DREBOUNCE_BUILD_DEMO=OFF -DREBOUNCE_BUILD_TESTS=OFF -DREBOUNCE_BUILD_BENCH=OFF)
  run(${CMAKE_COMMAND} --build ${BUILD} --target rebounce_runtime)
endif()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component runtime)
set(precompute OFF)
if(NOT ROOT)
  set(precompute ON)
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component precompute)
endif()
run(${PROGRAM} precompute ${SCENE} --store-form-factors --patches 100 --probes 2,2,2 --probe-rays 256 --quiet -o ${file})

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_CXX_COMPILER=${CXX_COMPILER}
    -DCMAKE_BUILD_TYPE=Release -DPRECOMPUTE=${precompute} -DHEADERS=${prefix}/include)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer_cpp ${file})
run(${WORK}/build/consumer_c ${file})
if(precompute)
  run(${WORK}/build/consumer_build ${SCENE} ${WORK}/built.safetensors)
  run(${WORK}/build/consumer_cpp ${WORK}/built.safetensors)
endif()

file(GLOB_RECURSE pc ${prefix}/*/rebounce.pc)
get_filename_component(pc_dir "${pc}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} ${pc_dir})
execute_process(COMMAND pkg-config --cflags --libs rebounce OUTPUT_VARIABLE flags
                OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${C_COMPILER} -std=c99 -pthread ${SOURCE}/consumer.c ${flags} -o ${WORK}/consumer_pc)
run(${WORK}/consumer_pc ${file})
