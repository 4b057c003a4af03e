# The viewer's page: built by npm in viewer/ where it is missing or older than its sources, then embedded in
# tendril_viewer as an array of bytes.
set(VIEWER_DIR ${PROJECT_SOURCE_DIR}/viewer)
set(VIEWER_PAGE ${VIEWER_DIR}/dist/page.html)
set(VIEWER_EMBEDDED ${CMAKE_CURRENT_BINARY_DIR}/viewer/page_template.cpp)

file(GLOB VIEWER_SOURCES CONFIGURE_DEPENDS ${VIEWER_DIR}/src/*)
list(APPEND VIEWER_SOURCES ${VIEWER_DIR}/index.html ${VIEWER_DIR}/vite.config.js ${VIEWER_DIR}/package-lock.json)
find_program(TENDRIL_NPM npm DOC "npm, which builds the viewer's page")

if(TENDRIL_NPM)
  add_custom_command(
    OUTPUT ${VIEWER_PAGE}
    COMMAND ${CMAKE_COMMAND} -DNPM=${TENDRIL_NPM} -DVIEWER_DIR=${VIEWER_DIR} -P ${PROJECT_SOURCE_DIR}/cmake/build_page.cmake
    DEPENDS ${VIEWER_SOURCES}
    COMMENT "Building the viewer's page"
    VERBATIM)
elseif(NOT EXISTS ${VIEWER_PAGE})
  message(FATAL_ERROR "The viewer's page ${VIEWER_PAGE} is missing and npm was not found to build it.\n"
                      "Install Node.js (18 or newer) and run `npm ci && npm run build` in ${VIEWER_DIR}.")
endif()

add_custom_command(
  OUTPUT ${VIEWER_EMBEDDED}
  COMMAND ${CMAKE_COMMAND} -DPAGE=${VIEWER_PAGE} -DOUT=${VIEWER_EMBEDDED} -P ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
  DEPENDS ${VIEWER_PAGE} ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
  COMMENT "Embedding the viewer's page"
  VERBATIM)
target_sources(tendril_viewer PRIVATE ${VIEWER_EMBEDDED})
target_include_directories(tendril_viewer PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/viewer)
