// How sure an answer of the recogniser of stems is.
#pragma once

#include "common/place_recognition/stem_recogniser.hpp"

namespace understory::place_recognition {

/// -log10 of about the probability that an answer is wrong: chance, another place, or farther from
/// the query than `radius_m` [m] (to 0.15 m per axis and frame, which truths leave open). 0 without
/// an answer.
double decades_of(const PlaceAnswer& answer, double radius_m);

}  // namespace understory::place_recognition
