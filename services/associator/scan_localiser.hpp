// Pose of the vehicle at a scan, relative to the tracks.
#pragma once

#include <span>

#include "common/geometry/registration.hpp"
#include "common/model/landmarks.hpp"
#include "services/associator/observation.hpp"
#include "services/associator/parameters.hpp"
#include "services/associator/track_list.hpp"

namespace understory::associator {

/// Result of the localisation of one scan.
struct Localisation {
  geometry::Registration pose;  ///< local_T_vehicle, with the pairs (per kind) used for it.
  bool fits = true;             ///< Enough of the possible matches were found.
  bool was_searched = false;    ///< The largest consistent set was searched.
};

/// Locates a scan from the predicted pose `guess` (local_T_vehicle) by the configured method.
/// Moving tracks are used only in the search. With the method "nearest" the guess is the result and
/// always fits; so does a scan without observations.
Localisation locate(std::span<const Track> tracks, std::span<const Observation> observations,
                    const model::FieldOfView& view, const geometry::SE2WithCovariance& guess,
                    const AssociatorParameters& parameters);

}  // namespace understory::associator
