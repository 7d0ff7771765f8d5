#include "deploy/cli/guarded_import.hpp"

#include <fmt/format.h>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"

namespace understory::cli {

void guarded_import(const std::function<void()>& import) {
  terminal::catch_interrupts();
  try {
    import();
  } catch (const io::DataError& error) {
    fail(error.what());
  } catch (const io::LogError& error) {
    fail(error.what());
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("import: {}", error.what()));
  }
}

}  // namespace understory::cli
