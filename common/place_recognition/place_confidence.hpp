// Confidence of an answer of the recogniser of stems.
#pragma once

#include "common/place_recognition/stem_recogniser.hpp"

namespace understory::place_recognition {

/// About -log10 of the probability that an answer is wrong: by chance, at another place, or farther
/// from the query than `radius_m` [m] (truth is uncertain by 0.15 m per axis and frame). 0 without
/// an answer.
double decades_of(const PlaceAnswer& answer, double radius_m);

}  // namespace understory::place_recognition
