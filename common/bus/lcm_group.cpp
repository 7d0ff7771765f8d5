#include "common/bus/lcm_group.hpp"

#include <utility>

#include "common/bus/bus_error.hpp"

namespace understory::bus {

LcmGroup::LcmGroup(std::string url) : url_(std::move(url)), lcm_(lcm_create(url_.c_str())) {
  if (lcm_ == nullptr) throw BusError(url_ + ": cannot join this bus");
  try {
    if (is_udpm_url(url_)) udpm_ = parse_udpm_url(url_);
  } catch (...) {
    lcm_destroy(lcm_);
    throw;
  }
}

std::optional<wire::Refusal> LcmGroup::publish(std::string_view channel,
                                               std::span<const std::uint8_t> bytes) {
  const int failed = lcm_publish(lcm_, std::string(channel).c_str(), bytes.data(),
                                 static_cast<unsigned>(bytes.size()));
  if (failed == 0) return std::nullopt;
  return wire::Refusal{wire::Reason::kNotSent,
                       "the socket refused " + std::to_string(bytes.size()) + " bytes"};
}

}  // namespace understory::bus
