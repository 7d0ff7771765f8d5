// A submap's parts as bytes of a file.
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

/// Coordinates and radii of stored landmarks are whole multiples of this [m]: an error of half of
/// it at most, far below any landmark's standard deviation.
inline constexpr double kLandmarkStep_m = 1e-4;
/// The entries of a stored covariance's Cholesky factor are whole multiples of this [m].
inline constexpr double kSigmaStep_m = 1e-5;

/// Bytes, packed by zlib behind their length.
std::vector<std::uint8_t> packed(std::string_view bytes);
/// What packed() was given; none where the bytes are damaged.
std::optional<std::string> unpacked(Blob bytes);

/// All that localisation needs of a submap: id, position, covariance, radius, number of
/// observations and kind of each landmark, about 17 bytes. Rounded to the steps above; a covariance
/// stays positive semidefinite. Values are such as fault_of() passes.
std::vector<std::uint8_t> landmark_bytes(std::span<const model::MapLandmark> landmarks);
/// Back; none where the bytes are damaged.
std::optional<std::vector<model::MapLandmark>> landmarks_in(Blob bytes);

/// Poses with their covariances, to the bit.
std::vector<std::uint8_t> keyframe_bytes(const std::vector<model::KeyframePose>& keyframes);
/// Back; none where the bytes are damaged.
std::optional<std::vector<model::KeyframePose>> keyframes_in(Blob bytes);

/// Numbers of submaps.
std::vector<std::uint8_t> id_bytes(std::span<const model::SubmapId> ids);
/// Back; none where the bytes are damaged.
std::optional<std::vector<model::SubmapId>> ids_in(Blob bytes);

/// Corners, rounded to centimetres.
std::vector<std::uint8_t> border_bytes(std::span<const Eigen::Vector2d> corners_m);
/// Back; none where the bytes are damaged.
std::optional<std::vector<Eigen::Vector2d>> border_in(Blob bytes);

/// The convex polygon around landmarks and keyframes, frame submap, half a metre wider than they
/// lie: three corners or more, the last one not the first again. At least one of them is there.
std::vector<Eigen::Vector2d> border_around(std::span<const Eigen::Vector2d> places_m);

}  // namespace understory::map_file
