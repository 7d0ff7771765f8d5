// The exception of all readers of recorded data.
#pragma once

#include <stdexcept>

namespace understory::io {

/// Recorded data is unreadable or invalid; what() states the file, the place in it and the expected
/// content.
class DataError : public std::runtime_error {
 public:
  /// Takes the one-line message for what().
  using std::runtime_error::runtime_error;
};

}  // namespace understory::io
