// Values as text.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "common/model/slam_output.hpp"

namespace understory::story {

/// A stamp for people: "12.345 s (utime 1700000012345000)", in seconds since `start`.
std::string when(model::Utime utime, model::Utime start);
/// A landmark: "1:23", the number of its map and its number there.
std::string landmark_name(model::LandmarkId id);
/// The same with the id as in messages: "1:23 (281474976710679)".
std::string landmark_name_and_id(model::LandmarkId id);
/// A position [m]: "x 1.23 m, y -4.56 m".
std::string place_words(const Eigen::Vector2d& place_m);
/// Half axes of the one-sigma ellipse [m]: "sigma 0.041 m and 0.032 m"; "sigma not told" for zero.
std::string sigma_words(const Eigen::Matrix2d& covariance_m2);
/// Status of a keyframe in a few words.
std::string_view status_words(model::MapUpdateStatus status);
/// Status of a pose in a sentence.
std::string status_words(const model::SlamPose& pose);
/// Whole numbers with their noun: "1 keyframe", "3 keyframes".
std::string counted(std::uint64_t number, std::string_view noun);
/// Loss by a limit: "earlier events were dropped: 120"; empty for 0.
std::string dropped_words(std::string_view what, std::uint64_t number);

}  // namespace understory::story
