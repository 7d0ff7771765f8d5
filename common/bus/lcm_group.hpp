// liblcm on one multicast group.
#pragma once

#include <lcm/lcm.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/bus/udpm_url.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// Sends into one group. Our own receiver receives udpm:// groups; liblcm receives others.
class LcmGroup {
 public:
  /// Throws BusError where the URL or its route is wrong.
  explicit LcmGroup(std::string url);
  ~LcmGroup() { lcm_destroy(lcm_); }
  LcmGroup(const LcmGroup&) = delete;
  LcmGroup& operator=(const LcmGroup&) = delete;

  /// Sends a message. Precondition: check_publishable() returns none.
  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes);
  /// The URL given to the constructor.
  const std::string& url() const { return url_; }
  /// The parts of a udpm:// URL; none for another URL (liblcm receives).
  const std::optional<UdpmUrl>& udpm() const { return udpm_; }
  /// Access to liblcm.
  lcm_t* lcm() const { return lcm_; }

  bool is_joined = false;  ///< Our receiver has joined the group.

 private:
  std::string url_;
  lcm_t* lcm_;
  std::optional<UdpmUrl> udpm_;
};

}  // namespace understory::bus
