# cmake -DNPM=... -DVIEWER_DIR=... -P build_page.cmake: builds viewer/dist/page.html where it is missing or older than
# its sources: `npm ci` where the packages are missing or older than the lock file, then `npm run build`.
file(LOCK ${VIEWER_DIR}/.build.lock GUARD PROCESS TIMEOUT 600)  # several build directories share one viewer/
set(PAGE ${VIEWER_DIR}/dist/page.html)
file(GLOB SOURCES ${VIEWER_DIR}/src/* ${VIEWER_DIR}/index.html ${VIEWER_DIR}/vite.config.js ${VIEWER_DIR}/package-lock.json)
set(STALE NO)
foreach(SOURCE IN LISTS SOURCES)
  if(${SOURCE} IS_NEWER_THAN ${PAGE})  # true, too, where there is no page
    set(STALE YES)
  endif()
endforeach()
if(NOT STALE)
  return()
endif()

set(INSTALLED ${VIEWER_DIR}/node_modules/.package-lock.json)
set(STEPS "run build")
if(${VIEWER_DIR}/package-lock.json IS_NEWER_THAN ${INSTALLED})
  list(PREPEND STEPS ci)
endif()
foreach(STEP IN LISTS STEPS)
  separate_arguments(ARGUMENTS UNIX_COMMAND "${STEP}")
  execute_process(COMMAND ${NPM} ${ARGUMENTS} WORKING_DIRECTORY ${VIEWER_DIR}
                  RESULT_VARIABLE RESULT OUTPUT_VARIABLE SAID ERROR_VARIABLE SAID)
  if(NOT RESULT EQUAL 0)
    message(FATAL_ERROR "The viewer's page was not built: `npm ${STEP}` failed.\n${SAID}\n"
                        "Run `npm ci && npm run build` in ${VIEWER_DIR}, then build again.")
  endif()
endforeach()
