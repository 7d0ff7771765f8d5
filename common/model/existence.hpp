// Existence of the landmarks of a map.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Existence of one landmark.
struct LandmarkExistence {
  LandmarkId id = 0;
  double probability = 1.0;  ///< Probability that it exists.
  /// False: judged as removed. It is not used, but still stored and expected in view.
  bool is_in_use = true;
  bool operator==(const LandmarkExistence&) const = default;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.probability, s.is_in_use);
  }
};

/// Channel EXISTENCE.
struct Existence {
  Utime utime = 0;  ///< Stamp of the keyframe.
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  bool is_whole = false;  ///< `landmarks` are all landmarks with a known probability.
  std::vector<LandmarkExistence> landmarks;  ///< In order of id.
  std::uint32_t known = 0;                   ///< Landmarks whose probability is known ...
  std::uint32_t unused = 0;                  ///< ... and those of them judged as removed.
  /// Share of unseen ones among the landmarks expected in view on the last metres; 0 to 1.
  double missing_share = 0.0;
  double new_share = 0.0;  ///< Share of new ones among the landmarks seen there; 0 to 1.
  bool is_mapping_needed = false;
};

/// Channel EXISTENCE_STATE: the tracker's state to continue with these landmarks later.
struct ExistenceState {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::vector<LandmarkExistence> landmarks;  ///< In order of id.
  std::string model;   ///< Learned values of detector and world, for all landmarks.
  std::string states;  ///< Equal number of bytes for each landmark, in the order of `landmarks`.

  /// The bytes of landmark `i` of `landmarks`.
  std::string state_of(std::size_t i) const {
    const std::size_t bytes = states.size() / landmarks.size();
    return states.substr(i * bytes, bytes);
  }
};

}  // namespace understory::model
