// The one exception of the readers of recorded data.
#pragma once

#include <stdexcept>

namespace understory::io {

/// Recorded data that cannot be read or is not what it should be; what() names the file, where in
/// it, and what was expected.
class DataError : public std::runtime_error {
 public:
  /// From the one-line message that what() gives.
  using std::runtime_error::runtime_error;
};

}  // namespace understory::io
