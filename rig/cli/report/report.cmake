# Builds the report's script, style and Chart.js (Debian: libjs-chart.js) into the program, so that it needs none of them where it runs.
find_file(CHART_JS NAMES chart.min.js PATHS /usr/share/javascript/chart.js /usr/share/nodejs/chart.js/dist NO_DEFAULT_PATH)
if(NOT CHART_JS)
  message(FATAL_ERROR "chart.min.js of Chart.js 3 is not installed; the report's charts need it: apt-get install libjs-chart.js")
endif()
set(assets_source "${CMAKE_CURRENT_BINARY_DIR}/report_assets.cc")
set(assets_script "${CMAKE_CURRENT_LIST_DIR}/embed.cmake")
set(assets_inputs "${CHART_JS}" "${CMAKE_CURRENT_LIST_DIR}/script.js" "${CMAKE_CURRENT_LIST_DIR}/style.css")
add_custom_command(OUTPUT "${assets_source}"
  COMMAND "${CMAKE_COMMAND}" "-DOUT=${assets_source}" "-DCHART_JS=${CHART_JS}" "-DFOLDER=${CMAKE_CURRENT_LIST_DIR}" -P "${assets_script}"
  DEPENDS ${assets_inputs} "${assets_script}" VERBATIM COMMENT "Building the report's files in")
target_sources(imrig_cli PRIVATE "${assets_source}")
