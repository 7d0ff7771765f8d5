#include "common/bus/own_addresses.hpp"

#include <ifaddrs.h>
#include <netinet/in.h>

#include <algorithm>

namespace understory::bus {
namespace {

constexpr std::int64_t kLookAgain_us = 1'000'000;

std::vector<std::uint32_t> addresses_of_interfaces() {
  std::vector<std::uint32_t> result;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return result;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    result.push_back(ntohl(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr));
  }
  ::freeifaddrs(first);
  return result;
}

}  // namespace

bool OwnAddresses::contains(std::uint32_t address, std::int64_t now_us) {
  const bool is_loopback = (address >> 24U) == 127;
  const auto is_known = [&] { return std::ranges::count(addresses_, address) > 0; };
  if (is_loopback || is_known()) return true;
  if (looked_us_ >= 0 && now_us - looked_us_ < kLookAgain_us) return false;
  looked_us_ = now_us;
  addresses_ = addresses_of_interfaces();
  return is_known();
}

}  // namespace understory::bus
