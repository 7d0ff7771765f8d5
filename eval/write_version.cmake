# Writes OUTPUT with the version of the source in SOURCE, if it changed. Run at every build.
execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty --tags
                OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR described STREQUAL "")
  set(described "${FALLBACK}")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "#pragma once\n#define UNDERSTORY_GIT_DESCRIBE \"${described}\"\n")
