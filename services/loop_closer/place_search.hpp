// Where among the places of the drive a new one lies.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "services/loop_closer/parameters.hpp"
#include "services/loop_closer/place_memory.hpp"
#include "services/loop_closer/place_verification.hpp"

namespace understory::loop_closer {

/// What is wrong with the choice of detector and verifier, with the key in front; empty where
/// nothing is.
std::string fault_of(const SearchParameters& search);
/// Whether detector or verifier compare clouds. Precondition: fault_of() finds nothing.
bool wants_clouds(const SearchParameters& search);

/// Detector and verifier, of those that `common/place_recognition` has. The places are its only
/// state, so it is made again from them.
class PlaceSearch {
 public:
  /// Without places. Throws std::invalid_argument where fault_of() finds something.
  PlaceSearch(const SearchParameters& search, const StemParameters& stems);

  /// Adds a place. Precondition: its keyframe is later than those before.
  void add(const Place& place);
  /// Looks for a place among those of keyframes up to `newest`; the one that answers first.
  /// `memory` has them all. The same places give the same answer.
  std::vector<FoundPlace> find(const Place& place, std::uint64_t newest,
                               const PlaceMemory& memory) const;
  /// Most poses that chance has around one place, of those that can be told apart.
  double poses_per_place() const;
  /// Distance of two places that are found [m].
  double reach_m() const { return reach_m_; }
  /// Who finds and verifies, as LOOP_CLOSURE tells it.
  const std::string& source() const { return source_; }
  /// Of the detector of stems.
  const place_recognition::StemNoise& stem_noise() const { return stem_noise_; }

 private:
  double reach_m_;
  std::string source_;
  place_recognition::StemNoise stem_noise_;
  std::unique_ptr<place_recognition::PlaceDetector> detector_;
  std::unique_ptr<PlaceVerification> verification_;  ///< None: the detector's evidence is enough.
};

/// Poses that are told apart [m], [rad]: by these chance has so many.
inline constexpr double kPoseCellM = 0.1;
inline constexpr double kPoseCellRad = 0.01;

}  // namespace understory::loop_closer
