// Drives as folders of stem tables, one for each frame, and a trajectory.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "common/model/stem_frame.hpp"

namespace understory::io {

/// The stems of one table (CSV): a heading with x_m and y_m and, if present, z_m, axis_x, axis_y,
/// axis_z (all three or none), dbh_m (0 or empty = not known) and score, in any order; frame
/// `sensor`. Empty lines and lines that start with # are skipped; a table without rows has no
/// stems. Throws DataError with `source` and line for a missing heading or column, an unknown or
/// repeated column, rows with another number of cells, values that are not finite numbers,
/// coordinates beyond 1 km, an axis of zero length, diameters outside 0 to 20 m, scores beyond 1e9.
std::vector<model::Stem> parse_stems(std::string_view text, std::string_view source);

/// The poses of a trajectory (TUM: stamp [s], x y z [m], quaternion x y z w of the sensor in the
/// world), one on each line, as frames without stems. Throws DataError with `source` and line for
/// another number of values, values that are not finite numbers, stamps that do not increase by a
/// microsecond or are beyond 1e11 s, positions beyond 1e8 m, quaternions whose length is not 1
/// within 1 %.
std::vector<model::StemFrame> parse_stem_trajectory(std::string_view text, std::string_view source);

/// The frames of a folder: frame_<n>.csv in the order of n, and trajectory.txt with a line for
/// each. Other files are ignored. Throws DataError with the file, and the line if any, for faults
/// refused by parse_stems() and parse_stem_trajectory(), a folder without frames or without a
/// trajectory, a name frame_*.csv without a number, a repeated number, and different numbers of
/// frames and lines.
std::vector<model::StemFrame> read_stem_frames(const std::filesystem::path& folder);

/// Writes frames for read_stem_frames(), rounded to 0.1 mm, 1e-6 of an axis and a microsecond;
/// numbers begin with 0. A missing folder is created. Throws DataError with the file; other files
/// in the folder stay, and a folder with frames is refused.
void write_stem_frames(const std::filesystem::path& folder,
                       std::span<const model::StemFrame> frames);

}  // namespace understory::io
