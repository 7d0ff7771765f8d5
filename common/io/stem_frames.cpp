#include "common/io/stem_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <system_error>

#include "common/io/data_error.hpp"
#include "common/io/output_file.hpp"
#include "common/io/text_file.hpp"

namespace understory::io {
namespace {

constexpr double kFarthestStemM = 1e3;
constexpr double kThickestStemM = 20.0;
constexpr double kHighestScore = 1e9;
constexpr double kFarthestPositionM = 1e8;
constexpr double kLatestStampS = 1e11;
constexpr double kQuaternionTolerance = 0.01;
constexpr std::string_view kStemTableMark = "\xEF\xBB\xBF";
constexpr std::string_view kTrajectoryName = "trajectory.txt";

enum StemColumn : std::size_t {
  kStemX,
  kStemY,
  kStemZ,
  kAxisX,
  kAxisY,
  kAxisZ,
  kStemDiameter,
  kStemScore,
  kStemColumns
};
constexpr std::array<std::string_view, kStemColumns> kStemColumnNames{
    "x_m", "y_m", "z_m", "axis_x", "axis_y", "axis_z", "dbh_m", "score"};

using Cells = std::vector<std::string_view>;

std::string_view trimmed_cell(std::string_view cell, std::string_view blanks) {
  const auto first = cell.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return cell.substr(first, cell.find_last_not_of(blanks) - first + 1);
}

/// Lines with content, with their numbers.
class DataLines {
 public:
  DataLines(std::string_view text, std::string_view source) : text_(text), source_(source) {
    if (text_.starts_with(kStemTableMark)) text_.remove_prefix(kStemTableMark.size());
  }

  std::optional<std::string_view> next() {
    while (!text_.empty()) {
      const std::size_t end = std::min(text_.find('\n'), text_.size());
      const std::string_view line = trimmed_cell(text_.substr(0, end), " \t\r");
      text_.remove_prefix(std::min(end + 1, text_.size()));
      ++number_;
      if (!line.empty() && line.front() != '#') return line;
    }
    return std::nullopt;
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw DataError(fmt::format("{}, line {}: {}", source_, number_, why));
  }

  /// A finite number of at most `most`.
  double number(std::string_view text, std::string_view what, double most,
                std::string_view unit) const {
    double value = 0.0;
    const char* const end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    if (text.empty() || result.ec != std::errc{} || result.ptr != end || !std::isfinite(value))
      refuse(fmt::format("{} '{}' is no finite number", what, text.substr(0, 40)));
    if (std::abs(value) > most)
      refuse(fmt::format("{} {} is beyond {} {}", what, value, most, unit));
    return value;
  }

 private:
  std::string_view text_;
  std::string_view source_;
  std::uint64_t number_ = 0;
};

Cells cells_by_comma(std::string_view line) {
  Cells cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(trimmed_cell(line.substr(begin, end - begin), " \t\""));
    begin = end + 1;
  }
  return cells;
}

Cells cells_by_blank(std::string_view line) {
  Cells cells;
  while (!(line = trimmed_cell(line, " \t")).empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    cells.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return cells;
}

/// Place of each column.
using StemColumns = std::array<std::optional<std::size_t>, kStemColumns>;

StemColumns columns_of_heading(const Cells& cells, const DataLines& lines) {
  StemColumns columns;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto* const known = std::ranges::find(kStemColumnNames, cells[i]);
    if (known == kStemColumnNames.end())
      lines.refuse(fmt::format("unknown column '{}'; known are {}", cells[i].substr(0, 40),
                               fmt::join(kStemColumnNames, ", ")));
    auto& place = columns[static_cast<std::size_t>(known - kStemColumnNames.begin())];
    if (place) lines.refuse(fmt::format("column {} comes twice", cells[i]));
    place = i;
  }

  for (const StemColumn column : {kStemX, kStemY}) {
    if (!columns[column]) lines.refuse(fmt::format("no column {}", kStemColumnNames[column]));
  }
  for (const StemColumn column : {kAxisX, kAxisY, kAxisZ}) {
    if (columns[column].has_value() != columns[kAxisX].has_value())
      lines.refuse("axis_x, axis_y and axis_z come together or not at all");
  }
  return columns;
}

Eigen::Vector3d axis_of(const Cells& cells, const StemColumns& columns, const DataLines& lines) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  if (!columns[kAxisX]) return axis;
  for (const StemColumn column : {kAxisX, kAxisY, kAxisZ})
    axis(column - kAxisX) =
        lines.number(cells[*columns[column]], kStemColumnNames[column], 1e6, "");
  if (axis.norm() < 1e-6) lines.refuse("the axis has no length");
  return axis.normalized();
}

double diameter_of(const Cells& cells, const StemColumns& columns, const DataLines& lines) {
  if (!columns[kStemDiameter] || cells[*columns[kStemDiameter]].empty()) return 0.0;
  const double diameter =
      lines.number(cells[*columns[kStemDiameter]], "dbh_m", kThickestStemM, "m");
  if (diameter < 0.0) lines.refuse(fmt::format("dbh_m {} is negative", diameter));
  return diameter;
}

model::Stem stem_of_row(const Cells& cells, const StemColumns& columns, const DataLines& lines) {
  model::Stem stem;
  for (const StemColumn column : {kStemX, kStemY, kStemZ}) {
    if (columns[column])
      stem.position_m(column) =
          lines.number(cells[*columns[column]], kStemColumnNames[column], kFarthestStemM, "m");
  }
  stem.axis = axis_of(cells, columns, lines);
  stem.diameter_m = diameter_of(cells, columns, lines);
  if (columns[kStemScore] && !cells[*columns[kStemScore]].empty())
    stem.score = lines.number(cells[*columns[kStemScore]], "score", kHighestScore, "");
  return stem;
}

/// The pose of a line, and its stamp.
model::StemFrame frame_of_line(const Cells& cells, const DataLines& lines) {
  constexpr std::array<std::string_view, 8> kNames{"stamp", "x", "y", "z", "qx", "qy", "qz", "qw"};
  if (cells.size() != kNames.size())
    lines.refuse(fmt::format("{} values, expected {}: stamp x y z qx qy qz qw", cells.size(),
                             kNames.size()));
  std::array<double, 8> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double most = i == 0 ? kLatestStampS : (i < 4 ? kFarthestPositionM : 2.0);
    v[i] = lines.number(cells[i], kNames[i], most, i == 0 ? "s" : (i < 4 ? "m" : ""));
  }

  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (std::abs(rotation.norm() - 1.0) > kQuaternionTolerance)
    lines.refuse(fmt::format("the quaternion's length is {:.3f}, not 1", rotation.norm()));
  model::StemFrame frame;
  frame.utime = std::llround(1e6 * v[0]);
  frame.world_T_sensor.linear() = rotation.normalized().toRotationMatrix();
  frame.world_T_sensor.translation() << v[1], v[2], v[3];
  return frame;
}

/// n of frame_<n>.csv; none for another name.
std::optional<std::int64_t> frame_number(const std::filesystem::path& file) {
  constexpr std::string_view kHead = "frame_";
  constexpr std::string_view kTail = ".csv";
  const std::string name = file.filename().string();
  if (!name.starts_with(kHead) || !name.ends_with(kTail)) return std::nullopt;
  const char* const begin = name.data() + kHead.size();
  const char* const end = name.data() + name.size() - kTail.size();
  std::int64_t number = 0;
  const auto result = std::from_chars(begin, std::max(begin, end), number);
  if (begin >= end || result.ec != std::errc{} || result.ptr != end || number < 0)
    throw DataError(fmt::format("{}: no number between frame_ and .csv", file.string()));
  return number;
}

std::map<std::int64_t, std::filesystem::path> frame_files(const std::filesystem::path& folder) {
  std::map<std::int64_t, std::filesystem::path> files;
  std::error_code failed;
  std::filesystem::directory_iterator at(folder, failed);
  for (; !failed && at != std::filesystem::directory_iterator(); at.increment(failed)) {
    const auto number = frame_number(at->path());
    if (!number) continue;
    const auto [earlier, is_new] = files.emplace(*number, at->path());
    if (!is_new)
      throw DataError(fmt::format("{}: frame {} is there twice, also as {}", at->path().string(),
                                  *number, earlier->second.filename().string()));
  }
  if (failed)
    throw DataError(
        fmt::format("{}: cannot be read as a folder: {}", folder.string(), failed.message()));
  return files;
}

/// The table has axes only if every stem has one.
std::string text_of_stems(const model::StemFrame& frame) {
  const bool has_axes =
      std::ranges::none_of(frame.stems, [](const model::Stem& stem) { return stem.axis.isZero(); });
  std::string text =
      has_axes ? "x_m,y_m,z_m,axis_x,axis_y,axis_z,dbh_m,score\n" : "x_m,y_m,z_m,dbh_m,score\n";
  for (const model::Stem& stem : frame.stems) {
    const Eigen::Vector3d& p = stem.position_m;
    text += fmt::format("{:.4f},{:.4f},{:.4f},", p.x(), p.y(), p.z());
    if (has_axes)
      text += fmt::format("{:.6f},{:.6f},{:.6f},", stem.axis.x(), stem.axis.y(), stem.axis.z());
    text += fmt::format("{:.4f},{:.4f}\n", stem.diameter_m, stem.score);
  }
  return text;
}

}  // namespace

std::vector<model::Stem> parse_stems(std::string_view text, std::string_view source) {
  DataLines lines(text, source);
  const auto heading = lines.next();
  if (!heading)
    throw DataError(fmt::format("{}: no heading ({})", source, fmt::join(kStemColumnNames, ",")));
  const Cells names = cells_by_comma(*heading);
  const StemColumns columns = columns_of_heading(names, lines);

  std::vector<model::Stem> stems;
  while (const auto line = lines.next()) {
    const Cells cells = cells_by_comma(*line);
    if (cells.size() != names.size())
      lines.refuse(fmt::format("{} cells, the heading has {}", cells.size(), names.size()));
    stems.push_back(stem_of_row(cells, columns, lines));
  }
  return stems;
}

std::vector<model::StemFrame> parse_stem_trajectory(std::string_view text,
                                                    std::string_view source) {
  DataLines lines(text, source);
  std::vector<model::StemFrame> frames;
  while (const auto line = lines.next()) {
    model::StemFrame frame = frame_of_line(cells_by_blank(*line), lines);
    if (!frames.empty() && frame.utime <= frames.back().utime)
      lines.refuse(fmt::format("stamp {:.6f} s is not after the one before, {:.6f} s",
                               1e-6 * static_cast<double>(frame.utime),
                               1e-6 * static_cast<double>(frames.back().utime)));
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<model::StemFrame> read_stem_frames(const std::filesystem::path& folder) {
  const auto files = frame_files(folder);
  if (files.empty())
    throw DataError(fmt::format("{}: no frame_<n>.csv in the folder", folder.string()));
  const std::filesystem::path trajectory = folder / kTrajectoryName;
  auto frames = parse_stem_trajectory(read_whole_file(trajectory), trajectory.string());
  if (frames.size() != files.size())
    throw DataError(fmt::format("{}: {} poses for {} frames", trajectory.string(), frames.size(),
                                files.size()));

  auto frame = frames.begin();
  for (const auto& [number, file] : files) {
    frame->number = number;
    frame->stems = parse_stems(read_whole_file(file), file.string());
    ++frame;
  }
  return frames;
}

void write_stem_frames(const std::filesystem::path& folder,
                       std::span<const model::StemFrame> frames) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    throw DataError(fmt::format("{}: cannot be made: {}", folder.string(), failed.message()));
  if (!frame_files(folder).empty())
    throw DataError(fmt::format("{}: has frames already", folder.string()));

  std::string trajectory;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    write_whole_file(folder / fmt::format("frame_{}.csv", i), text_of_stems(frames[i]));
    const Eigen::Vector3d p = frames[i].world_T_sensor.translation();
    const Eigen::Quaterniond q(frames[i].world_T_sensor.linear());
    trajectory += fmt::format("{:.6f} {:.4f} {:.4f} {:.4f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                              1e-6 * static_cast<double>(frames[i].utime), p.x(), p.y(), p.z(),
                              q.x(), q.y(), q.z(), q.w());
  }
  write_whole_file(folder / kTrajectoryName, trajectory);
}

}  // namespace understory::io
