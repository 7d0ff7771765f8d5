// Where the frame of a map lies in the world of the ground truth.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "common/model/held_map.hpp"
#include "common/model/map.hpp"
#include "deploy/cli/truth_track.hpp"
#include "understory/config_t.hpp"

namespace understory::cli {

/// Where a map's frame is tied to the world, in order of preference. A map that was driven has its
/// frame at the base of its first keyframe. A map that was given has one of its own.
enum class MapTie {
  kFirstMap,       ///< At the update that started the map.
  kWorld,          ///< The given map is in the frame of the ground truth: a survey, for instance.
  kBestFit,        ///< Of a given map: by all keyframes, as well as they fit.
  kFirstKeyframe,  ///< At the oldest keyframe of the last MAP: the recorder missed that update.
  kFirstUpdate,    ///< At the first update recorded: its own error is in every other one.
};
/// In words, for the table.
const char* to_string(MapTie tie);

/// A map's frame in the world.
struct TiedMap {
  geometry::SE2 world_T_map;
  MapTie tie = MapTie::kFirstMap;
  /// The true pose to which it is tied; none where it is tied by many.
  std::optional<geometry::SE2> true_world_T_vehicle;
};

/// Collects what says where the maps of a run lie.
class MapTies {
 public:
  void take(const model::MapUpdate& update);   ///< In the order of the log.
  void take(const config_t& config);           ///< Says whether the mapper was given a map.
  void take_given_map() { is_given_ = true; }  ///< GIVEN_MAP is in the log.

  /// Where the map lies; none where the log has no truth at any instant of it. Of a map before the
  /// last one only where it started in the log, or was given. `held`: the last map. O(keyframes).
  std::optional<TiedMap> tie(std::uint32_t map_id, const TruthTrack& truth,
                             const model::HeldMap& held) const;
  /// Whether the mapper was given a map to begin with.
  bool has_given_map() const { return is_given_; }
  /// Number of the map of the last update.
  std::uint32_t last_map_id() const { return last_map_id_; }

 private:
  /// A located keyframe as it was published.
  struct Located {
    model::Utime utime = 0;
    geometry::SE2 map_T_vehicle;
    double variance_m2 = 0.0;  ///< Of the position, per axis.
  };
  std::map<std::uint32_t, Located> started_;               ///< By the map that it started.
  std::map<std::uint32_t, std::vector<Located>> located_;  ///< By map.
  std::uint32_t last_map_id_ = 1;
  bool is_given_ = false;
};

/// A pose in the map and the true one of the same instant.
struct MapAndWorldPose {
  geometry::SE2 map_T_vehicle;
  geometry::SE2 world_T_vehicle;
  double variance_m2 = 0.0;  ///< Of the position in the map, per axis; above 0.
};
/// The frame of a map that has no start, by poses in it: the world's own where they agree with it
/// about as well (median error at most 0.1 m above the best fit's), else the best fit by their
/// variances, headings included; wrong ones pull little. Near the origin of a map poses are known
/// best: there the map hangs. Precondition: not empty.
TiedMap fitted_frame(const std::vector<MapAndWorldPose>& poses);

}  // namespace understory::cli
