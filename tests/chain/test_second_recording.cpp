// A second recording is played into a stack that has heard one: another place, at another time.
#include <algorithm>
#include <optional>

#include "tests/catch.hpp"
#include "tests/chain/late_chain.hpp"

using namespace understory;
using namespace understory::test;

namespace {

constexpr model::Utime kSecond = 1'000'000;
constexpr model::Utime kHour = 3'600 * kSecond;
constexpr model::Utime kFirstBegins = 10 * kHour;
/// From its first message on [s]; the mapper needs some keyframes.
constexpr double kBeginsMapWithin_s = 4.0;

/// What was heard while the second recording was played.
struct Heard {
  std::optional<double> new_map_s;  ///< The first pose in another map.
  std::set<std::string> reasons;    ///< "process reason", of HEALTH.
};

Heard play(LateChain& chain, const std::vector<TapeEntry>& tape, std::uint32_t old_map) {
  Heard heard;
  for (const TapeEntry& entry : tape) {
    chain.feed(entry.message);
    if (entry.message.channel != "RAW_SWEEP") continue;
    for (const std::string& service : chain.services()) {
      const health_t health = chain.health_of(service);
      for (const auto& reason : health.reasons) heard.reasons.insert(service + " " + reason.reason);
    }
    const model::SlamPose& pose = chain.slam.back();
    if (!heard.new_map_s && pose.is_localised() && pose.map_id != old_map)
      heard.new_map_s = entry.at_s;
  }
  return heard;
}

template <class Pose>
bool stamps_grow(const std::vector<Pose>& poses) {
  return std::ranges::is_sorted(poses, std::ranges::less_equal(), &Pose::utime);
}

}  // namespace

TEST_CASE("a second recording begins a new map, and HEALTH says so", "[second]") {
  const std::vector<TapeEntry> first = record({.seed = 41, .begins_at = kFirstBegins});
  const model::Utime first_ends = kFirstBegins + static_cast<model::Utime>(1e6 * first.back().at_s);
  for (const model::Utime begins_at :
       {first_ends + kSecond, first_ends + 20 * kSecond, first_ends + kHour, kFirstBegins - kHour,
        kFirstBegins, model::Utime{0}}) {
    CAPTURE((begins_at - first_ends) / kSecond);
    LateChain chain;
    for (const TapeEntry& entry : first) chain.feed(entry.message);
    const std::size_t before = chain.slam.size();
    const std::uint32_t old_map = chain.slam.back().map_id;
    const std::uint64_t resets = chain.ekf.back().reset_counter;
    REQUIRE(before > 200);

    const Heard heard = play(chain, record({.seed = 42, .begins_at = begins_at}), old_map);
    REQUIRE(heard.new_map_s);
    CHECK(*heard.new_map_s < kBeginsMapWithin_s);
    CHECK(chain.ekf.back().reset_counter > resets);
    CHECK(heard.reasons.contains("lidar_imu_input restarted"));
    CHECK(heard.reasons.contains("ekf restarted"));
    CHECK(heard.reasons.contains("geoslam_mapper new_map"));

    // Nothing of the second place is placed in the map of the first one.
    const auto is_in_old = [old_map](const model::SlamPose& pose) {
      return pose.is_localised() && pose.map_id == old_map;
    };
    CHECK(std::none_of(chain.slam.begin() + static_cast<std::ptrdiff_t>(before), chain.slam.end(),
                       is_in_old));
    CHECK(chain.slam.size() - before > 200);
    CHECK(stamps_grow(chain.slam));
    CHECK(stamps_grow(chain.ekf));
  }
}
