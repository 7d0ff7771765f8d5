// Search for a new place among the places of the drive.
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

/// Fault of the configured detector and verifier, with the key in front; empty if there is none.
std::string fault_of(const SearchParameters& search);
/// Whether detector or verifier compare clouds. Precondition: fault_of() returns no fault.
bool wants_clouds(const SearchParameters& search);

/// Detector and verifier from `common/place_recognition`. Their only state is the places, so a load
/// rebuilds it from them.
class PlaceSearch {
 public:
  /// Without places. Throws std::invalid_argument if fault_of() returns a fault.
  PlaceSearch(const SearchParameters& search, const StemParameters& stems);

  /// Adds a place. Precondition: its keyframe is later than those before.
  void add(const Place& place);
  /// Searches for a place among those of keyframes up to `newest`, best match first. `memory` has
  /// them all. The same places give the same result.
  std::vector<FoundPlace> find(const Place& place, std::uint64_t newest,
                               const PlaceMemory& memory) const;
  /// Largest number of distinguishable poses around one place.
  double poses_per_place() const;
  /// Largest distance of two matching places [m].
  double reach_m() const { return reach_m_; }
  /// Names of detector and verifier, as in LOOP_CLOSURE.
  const std::string& source() const { return source_; }
  /// Noise model of the stem detector.
  const place_recognition::StemNoise& stem_noise() const { return stem_noise_; }

 private:
  double reach_m_;
  std::string source_;
  place_recognition::StemNoise stem_noise_;
  std::unique_ptr<place_recognition::PlaceDetector> detector_;
  std::unique_ptr<PlaceVerification>
      verification_;  ///< Null: the detector's evidence is sufficient.
};

/// Cell size of distinguishable poses [m], [rad], for counting poses.
inline constexpr double kPoseCellM = 0.1;
inline constexpr double kPoseCellRad = 0.01;

}  // namespace understory::loop_closer
