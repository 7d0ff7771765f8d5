// Common handling of logs that cannot be read or written.
#pragma once

#include <memory>
#include <utility>

#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"

namespace understory::cli {

/// `work` on the options as a callback; an error of a log and Ctrl-C end the command with a line
/// that has the file. Options have a `file`.
template <class Options, class Work>
auto guarded(std::shared_ptr<Options> options, Work work) {
  return [options = std::move(options), work = std::move(work)] {
    try {
      work(*options);
    } catch (const io::LogError& error) {
      fail(error.what());
    } catch (const terminal::Interrupted& error) {
      fail(options->file + ": " + error.what());
    }
  };
}

}  // namespace understory::cli
