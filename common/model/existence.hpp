// Whether the landmarks of a map are still there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Of one landmark.
struct LandmarkExistence {
  LandmarkId id = 0;
  double probability = 1.0;  ///< That it exists.
  bool is_in_use = true;     ///< False: taken for gone. Not to be used, but kept and looked for.
  bool operator==(const LandmarkExistence&) const = default;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.probability, s.is_in_use);
  }
};

/// Channel EXISTENCE.
struct Existence {
  Utime utime = 0;  ///< Of the keyframe.
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  bool is_whole = false;                     ///< These are all whose probability is known.
  std::vector<LandmarkExistence> landmarks;  ///< In order of id.
  std::uint32_t known = 0;                   ///< Landmarks whose probability is known ...
  std::uint32_t unused = 0;                  ///< ... and those of them that are taken for gone.
  /// Of the landmarks that should have been seen on the last metres, those that were not; 0 to 1.
  double missing_share = 0.0;
  double new_share = 0.0;  ///< Of what was seen there, that which is new to the map; 0 to 1.
  bool is_mapping_needed = false;
};

/// Channel EXISTENCE_STATE: what the tracker needs to go on with these landmarks later.
struct ExistenceState {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::vector<LandmarkExistence> landmarks;  ///< In order of id.
  std::string model;   ///< What was learned of detector and world, for all landmarks.
  std::string states;  ///< The same number of bytes for each landmark, in their order.

  /// The bytes of landmark `i` of `landmarks`.
  std::string state_of(std::size_t i) const {
    const std::size_t bytes = states.size() / landmarks.size();
    return states.substr(i * bytes, bytes);
  }
};

}  // namespace understory::model
