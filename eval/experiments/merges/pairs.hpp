// Two maps of one forest with the truth about them, and what merging makes of them.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/map_merge/fusion.hpp"

namespace understory::eval::experiments::merges {

/// A landmark of a map that is no tree.
inline constexpr std::size_t kNoTree = std::numeric_limits<std::size_t>::max();

/// A map, and which tree each of its landmarks is.
struct KnownMap {
  map_file::StoredMap map;
  std::vector<std::size_t> trees;  ///< As many as landmarks; kNoTree where there is none.
};

/// Two of them. Their frames are their own.
struct MapPair {
  KnownMap first;   ///< Map 1.
  KnownMap second;  ///< Map 2.
  geometry::SE2 first_T_second;
  bool overlaps = true;
};

/// A forest at two visits.
struct Visits {
  std::vector<Eigen::Vector2d> trees_m;
  std::vector<bool> at_first;   ///< Whether a tree stands at the first visit; as many as trees.
  std::vector<bool> at_second;  ///< Likewise.
};
/// All trees stand at both.
Visits unchanged(std::vector<Eigen::Vector2d> trees_m);
/// Trees with the same coordinates are one.
Visits visits_of(const std::vector<Eigen::Vector2d>& first_m,
                 const std::vector<Eigen::Vector2d>& second_m);

/// How two maps are cut out of a forest.
struct CutSetting {
  double overlap = 0.5;    ///< Share of each map's width; negative: a gap of that share.
  double common = 0.64;    ///< Probability that a map has a tree that stands.
  double sigma_m = 0.1;    ///< Of a landmark, per axis.
  double width_m = 120.0;  ///< Of a map and its height, at most what the forest gives.
};

/// Two rectangles beside each other, somewhere in the forest; the same seed gives the same pair.
MapPair cut_maps(const Visits& visits, const CutSetting& setting, std::uint64_t seed);

/// How two drives go through one forest.
struct DriveSetting {
  double side_m = 260.0;    ///< Of the forest.
  double seen = 0.64;       ///< Share of the trees that there is to be seen, drawn for each drive.
  double length_m = 200.0;  ///< Of each drive: a circle, begun anywhere in the middle.
  double sigma_m = 0.2;     ///< Of a detection, per axis.
};

/// The maps that keyframer and mapper make of two drives with noise of their own; method
/// `smoothing`. Throws terminal::Interrupted.
MapPair drive_maps(const DriveSetting& setting, std::uint64_t seed, const std::atomic<bool>& stop);

/// What merging gave.
struct MergeTrial {
  bool overlaps = true;
  bool merged = false;
  bool wrong =
      false;  ///< Merged, and a landmark more than 1 m from where it belongs, or no overlap.
  std::size_t landmarks = 0;       ///< Of the merged map.
  std::size_t doubled = 0;         ///< Of them beyond the number of trees that they are.
  std::size_t doubled_before = 0;  ///< The same of the two maps before.
  double share = 0.0;              ///< Pairs over landmarks in the overlap.
  double offset_m = 0.0;           ///< Error of the motion in the middle of the pairs.
  double sigma_m = 0.0;            ///< The stated one there, larger axis.
  double nees = 0.0;               ///< Three degrees of freedom.
  double log10_false_alarm = 0.0;
  double ms = 0.0;  ///< Processor time of the search.
};

/// Looks for the overlap, and fuses.
MergeTrial merge_trial(const MapPair& pair);

}  // namespace understory::eval::experiments::merges
