// liblcm on one group.
#pragma once

#include <lcm/lcm.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/bus/udpm_url.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// Everything that is sent into a group. For udpm:// our own receiver hears it, for others liblcm.
class LcmGroup {
 public:
  /// Throws BusError where the URL or its route is wrong.
  explicit LcmGroup(std::string url);
  ~LcmGroup() { lcm_destroy(lcm_); }
  LcmGroup(const LcmGroup&) = delete;
  LcmGroup& operator=(const LcmGroup&) = delete;

  /// Sends a message. Precondition: check_publishable() has no objection.
  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes);
  /// As given to the constructor.
  const std::string& url() const { return url_; }
  /// The parts of a udpm:// URL; none = liblcm receives.
  const std::optional<UdpmUrl>& udpm() const { return udpm_; }
  /// For what only liblcm can do.
  lcm_t* lcm() const { return lcm_; }

  bool is_joined = false;  ///< Our receiver hears it.

 private:
  std::string url_;
  lcm_t* lcm_;
  std::optional<UdpmUrl> udpm_;
};

}  // namespace understory::bus
