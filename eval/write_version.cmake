# Writes OUTPUT with the version of the source in SOURCE, if it changed. Run at every build.
# Stored results do not make the version dirty: eval/results/refresh writes them while it goes on.
execute_process(COMMAND git -C "${SOURCE}" describe --always --tags
                OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
execute_process(COMMAND git -C "${SOURCE}" status --porcelain --untracked-files=no -- . ":!eval/results/*" ":!README.md"
                OUTPUT_VARIABLE changes OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT changes STREQUAL "")
  string(APPEND described "-dirty")
endif()

if(failed OR described STREQUAL "")
  set(described "${FALLBACK}")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "#pragma once\n#define UNDERSTORY_GIT_DESCRIBE \"${described}\"\n")
