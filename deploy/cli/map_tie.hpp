// Pose of a map's frame in the world of the ground truth.
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

/// How a map's frame is tied to the world, in order of preference. The frame of a driven map is the
/// base of its first keyframe. A given map has its own frame.
enum class MapTie {
  kFirstMap,       ///< At the update that started the map.
  kWorld,          ///< The given map is in the frame of the ground truth, e.g. a survey.
  kBestFit,        ///< For a given map: best fit of all keyframes.
  kFirstKeyframe,  ///< At the oldest keyframe of the last MAP: the recorder missed that update.
  kFirstUpdate,    ///< At the first recorded update: its error is included in all others.
};
/// Text for the table.
const char* to_string(MapTie tie);

/// A map's frame in the world.
struct TiedMap {
  geometry::SE2 world_T_map;
  MapTie tie = MapTie::kFirstMap;
  /// The true pose of the tie; none for a tie by many poses.
  std::optional<geometry::SE2> true_world_T_vehicle;
};

/// Collects messages for the ties of a run's maps.
class MapTies {
 public:
  void take(const model::MapUpdate& update);  ///< Takes an update, in the order of the log.
  void take(const config_t& config);  ///< Takes a configuration, which states whether the mapper
                                      ///< got a given map.
  void take_given_map() { is_given_ = true; }  ///< GIVEN_MAP is in the log.

  /// The tie of a map; none where the log has no truth at any instant of it. For a map before the
  /// last one only if it started in the log or was given. `held`: the last map. O(keyframes).
  std::optional<TiedMap> tie(std::uint32_t map_id, const TruthTrack& truth,
                             const model::HeldMap& held) const;
  /// Whether the mapper started with a given map.
  bool has_given_map() const { return is_given_; }
  /// Number of the map of the last update.
  std::uint32_t last_map_id() const { return last_map_id_; }

 private:
  /// A published located keyframe.
  struct Located {
    model::Utime utime = 0;
    geometry::SE2 map_T_vehicle;
    double variance_m2 = 0.0;  ///< Variance of the position, per axis.
  };
  std::map<std::uint32_t, Located> started_;  ///< First keyframe by the map that it started.
  std::map<std::uint32_t, std::vector<Located>> located_;  ///< Keyframes by map.
  std::uint32_t last_map_id_ = 1;
  bool is_given_ = false;
};

/// A pose in the map and the true one of the same instant.
struct MapAndWorldPose {
  geometry::SE2 map_T_vehicle;
  geometry::SE2 world_T_vehicle;
  double variance_m2 = 0.0;  ///< Variance of the position in the map, per axis; above 0.
};
/// The frame of a map without a start, from poses in it: the world's frame if it fits nearly as
/// well (median error at most 0.1 m above the best fit's), else the best fit weighted by their
/// variances, headings included; wrong poses have little weight. Poses near the origin of a map
/// have the least variance and dominate the fit. Precondition: not empty.
TiedMap fitted_frame(const std::vector<MapAndWorldPose>& poses);

}  // namespace understory::cli
