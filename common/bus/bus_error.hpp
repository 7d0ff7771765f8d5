// A bus that cannot be used.
#pragma once

#include <stdexcept>

namespace understory::bus {

/// The bus cannot be joined; what() names the URL.
class BusError : public std::runtime_error {
 public:
  /// Takes the one-line message for what().
  using std::runtime_error::runtime_error;
};

}  // namespace understory::bus
