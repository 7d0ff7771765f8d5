// Encodes a submap's parts as bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// Coordinates and radii of stored landmarks are whole multiples of this [m]: the error is at most
/// half of it, far below any landmark's standard deviation.
inline constexpr double kLandmarkStep_m = 1e-4;
/// The entries of a stored covariance's Cholesky factor are whole multiples of this [m].
inline constexpr double kSigmaStep_m = 1e-5;

/// Packs bytes by zlib, after their length.
std::vector<std::uint8_t> packed(std::string_view bytes);
/// Reverses packed(); none where the bytes are damaged.
std::optional<std::string> unpacked(Blob bytes);

/// Encodes the data for localisation in a submap: id, position, covariance, radius, number of
/// observations and kind of each landmark, about 17 bytes. Rounded to the steps above; a covariance
/// stays positive semidefinite. Precondition: fault_of() finds no fault.
std::vector<std::uint8_t> landmark_bytes(std::span<const model::MapLandmark> landmarks);
/// Decodes; none where the bytes are damaged.
std::optional<std::vector<model::MapLandmark>> landmarks_in(Blob bytes);

/// Encodes poses with their covariances, exact to the bit.
std::vector<std::uint8_t> keyframe_bytes(const std::vector<model::KeyframePose>& keyframes);
/// Decodes; none where the bytes are damaged.
std::optional<std::vector<model::KeyframePose>> keyframes_in(Blob bytes);

/// Encodes numbers of submaps.
std::vector<std::uint8_t> id_bytes(std::span<const model::SubmapId> ids);
/// Decodes; none where the bytes are damaged.
std::optional<std::vector<model::SubmapId>> ids_in(Blob bytes);

/// Encodes corners, rounded to centimetres.
std::vector<std::uint8_t> border_bytes(std::span<const Eigen::Vector2d> corners_m);
/// Decodes; none where the bytes are damaged.
std::optional<std::vector<Eigen::Vector2d>> border_in(Blob bytes);

/// The convex polygon around landmarks and keyframes, frame submap, with a margin of half a metre:
/// three corners or more, without repeating the first one. Precondition: at least one landmark or
/// keyframe.
std::vector<Eigen::Vector2d> border_around(std::span<const Eigen::Vector2d> places_m);

}  // namespace understory::map_file
