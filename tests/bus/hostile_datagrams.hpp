// Datagrams that mean harm, built from the wire format: every field is right, at a bound, beyond it
// or anything; fragments belong together often enough to get behind the first checks.
#pragma once

#include <random>
#include <utility>

#include "tests/bus/datagrams.hpp"

namespace understory::test {

/// The same seed gives the same datagrams.
class HostileDatagrams {
 public:
  explicit HostileDatagrams(std::uint64_t seed) : random_(seed) {}

  Datagram next() {
    Datagram datagram = built();
    switch (below(16)) {
      case 0:  // cut anywhere
        datagram.resize(below(datagram.size() + 1));
        break;
      case 1:  // some bytes changed, in the header more often than not
        for (std::size_t i = 0; i < 1 + below(4) && !datagram.empty(); ++i) {
          const std::size_t range =
              below(4) == 0 ? datagram.size() : std::min<std::size_t>(24, datagram.size());
          datagram[below(range)] = static_cast<std::uint8_t>(random_());
        }
        break;
      case 2:  // once more
        if (!last_.empty()) datagram = last_;
        break;
      default:
        break;
    }
    last_ = datagram;
    return datagram;
  }

  std::size_t below(std::size_t bound) { return bound == 0 ? 0 : random_() % bound; }

 private:
  Datagram built() {
    if (below(4) == 0) return short_datagram(number_32(), channel_field(), payload());
    if (below(8) == 0) return noise();
    if (plan_.empty() || below(64) == 0) make_plan();

    // A planned, valid fragment; or one of the same message with a field or two that lie.
    if (below(3) == 0) {
      const Datagram valid = plan_.back();
      plan_.pop_back();
      return valid;
    }
    FragmentHeader header = planned_;
    header.number = static_cast<std::uint16_t>(below(header.count + 1U));
    header.offset = static_cast<std::uint32_t>(below(header.message_size + 1U));
    for (std::size_t lies = below(3); lies > 0; --lies) lie(header);
    const bool has_channel = header.number == 0 ? below(8) != 0 : below(8) == 0;
    return fragment_datagram(header, has_channel ? channel_field() : "", payload());
  }

  /// A message whose fragments are sent among the lies.
  void make_plan() {
    const std::size_t size = 1 + below(below(16) == 0 ? 200000 : 5000);
    const Datagram bytes(size, static_cast<std::uint8_t>(random_()));
    planned_ = {static_cast<std::uint32_t>(below(4)), static_cast<std::uint32_t>(size), 0, 0, 1};
    plan_ =
        fragments_of(planned_.sequence, "GOOD", bytes, 64 + below(below(4) == 0 ? 60000 : 1400));
    planned_.count = static_cast<std::uint16_t>(plan_.size());
    std::shuffle(plan_.begin(), plan_.end(), random_);
  }

  void lie(FragmentHeader& header) {
    switch (below(5)) {
      case 0:
        header.sequence = number_32();
        break;
      case 1:
        header.message_size = number_32();
        break;
      case 2:
        header.offset = number_32();
        break;
      case 3:
        header.number = number_16();
        break;
      default:
        header.count = number_16();
        break;
    }
  }

  std::uint32_t number_32() {
    const std::uint32_t size = planned_.message_size;
    const std::uint32_t bounds[] = {
        0,          1,          size - 1,   size,
        size + 1,   0x0FFFFFFF, 0x10000000, 0x10000001,
        0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0U - size,
        0xFFFFFFC0, 65535,      65536,      static_cast<std::uint32_t>(random_())};
    return bounds[below(std::size(bounds))];
  }

  std::uint16_t number_16() {
    const std::uint16_t bounds[] = {
        0,      1,      2,      planned_.count, static_cast<std::uint16_t>(planned_.count + 1),
        0x7FFF, 0x8000, 0xFFFE, 0xFFFF,         static_cast<std::uint16_t>(random_())};
    return bounds[below(std::size(bounds))];
  }

  std::string channel_field() {
    switch (below(8)) {
      case 0:
        return "";
      case 1:
        return with_nul("");
      case 2:
        return "HEALTH";  // no NUL
      case 3:
        return with_nul(std::string(63, 'A'));
      case 4:
        return with_nul(std::string(64, 'A'));
      case 5:
        return std::string(60 + below(200), 'A');
      case 6:
        return with_nul("\x1b[2J\xff");
      default:
        return with_nul("HEALTH");
    }
  }

  Datagram payload() {
    const std::size_t most = below(64) == 0 ? 65000 : below(4) == 0 ? 1400 : 100;
    return Datagram(below(most + 1), static_cast<std::uint8_t>(random_()));
  }

  Datagram noise() {
    Datagram datagram(below(100));
    for (auto& byte : datagram) byte = static_cast<std::uint8_t>(random_());
    return datagram;
  }

  std::mt19937_64 random_;
  FragmentHeader planned_;
  std::vector<Datagram> plan_;
  Datagram last_;
};

}  // namespace understory::test
