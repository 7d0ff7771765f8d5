#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "common/bag/cloud_file.hpp"
#include "common/io/data_error.hpp"
#include "common/io/date_time.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"

namespace understory::bag {
namespace {

/// Seconds of a number in a file's name: seconds since 1970 have ten digits, each finer unit three
/// more.
double seconds_of(double number) {
  if (number > 1e17) return number * 1e-9;
  if (number > 1e14) return number * 1e-6;
  if (number > 1e11) return number * 1e-3;
  return number;
}

/// Names that count 0, 1, 2, ... or 1, 2, 3, ... are no times.
bool is_counting(const std::vector<double>& numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] != numbers.front() + static_cast<double>(i)) return false;
  }
  return numbers.size() > 1 && numbers.front() >= 0.0 && numbers.front() < 1e6;
}

/// The name as a number; none for "scan_000001".
std::optional<double> number_of(const CloudEntry& file) {
  const std::string stem = file.path.stem().string();
  double number = 0.0;
  const auto read = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  if (read.ec != std::errc{} || read.ptr != stem.data() + stem.size() || !std::isfinite(number))
    return std::nullopt;
  return number;
}

/// Counting names are numbers of periods; of other names only the order is used.
std::vector<double> seconds_by_rate(const std::vector<double>& numbers, double rate_hz) {
  std::vector<double> seconds;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    seconds.push_back((is_counting(numbers) ? numbers[i] : static_cast<double>(i)) / rate_hz);
  return seconds;
}

std::vector<double> seconds_of_names(std::vector<CloudEntry>& files,
                                     const std::filesystem::path& folder, double rate_hz) {
  std::vector<std::pair<double, CloudEntry>> numbered;
  for (const CloudEntry& file : files) {
    const std::optional<double> number = number_of(file);
    if (!number && rate_hz <= 0.0)
      throw io::DataError(fmt::format(
          "{}: a name that is no time: timestamps.txt or times.txt states the files' times, --rate "
          "HZ how many files a second has",
          file.path.string()));
    if (!number) return seconds_by_rate(std::vector<double>(files.size(), 0.0), rate_hz);
    numbered.emplace_back(*number, file);
  }
  std::ranges::stable_sort(numbered, {}, &std::pair<double, CloudEntry>::first);

  std::vector<double> numbers;
  for (std::size_t i = 0; i < files.size(); ++i) {
    files[i] = numbered[i].second;
    numbers.push_back(numbered[i].first);
  }
  if (rate_hz > 0.0) return seconds_by_rate(numbers, rate_hz);
  if (is_counting(numbers))
    throw io::DataError(fmt::format(
        "{}: names that count {:g} to {:g} are no times; --rate HZ states how many files a second "
        "has, timestamps.txt their times",
        folder.string(), numbers.front(), numbers.back()));
  for (double& number : numbers) number = seconds_of(number);
  return numbers;
}

/// The cloud files in order of names; all of one kind.
std::vector<CloudEntry> cloud_files(const std::filesystem::path& folder) {
  std::map<std::string, std::vector<CloudEntry>> by_kind;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    const std::string kind = entry.path().extension().string();
    if (kind == ".pcd" || kind == ".ply" || kind == ".bin")
      by_kind[kind].push_back({0, entry.path()});
  }
  if (failed || by_kind.empty())
    throw io::DataError(
        fmt::format("{}: no folder with .pcd, .ply or .bin files", folder.string()));
  if (by_kind.size() > 1)
    throw io::DataError(fmt::format("{}: {} and {} files: one kind is wanted", folder.string(),
                                    by_kind.begin()->first, by_kind.rbegin()->first));
  std::vector<CloudEntry> files = by_kind.begin()->second;
  std::ranges::sort(files, {}, &CloudEntry::path);
  return files;
}

/// KITTI has the times in the parent of the clouds' folder: times.txt, or timestamps.txt in raw
/// drives.
std::optional<std::filesystem::path> stamps_beside(const std::filesystem::path& folder) {
  std::error_code failed;
  const std::filesystem::path above = std::filesystem::absolute(folder / "..").lexically_normal();
  for (const std::filesystem::path& file : {folder / "timestamps.txt", folder / "times.txt",
                                            above / "times.txt", above / "timestamps.txt"}) {
    if (std::filesystem::exists(file, failed)) return file;
  }
  return std::nullopt;
}

std::vector<double> seconds_in(const std::filesystem::path& stamps) {
  const std::string text =
      io::RecordingFolder(stamps.parent_path()).read(stamps.filename().string());
  std::vector<double> seconds;
  if (io::begins_with_date(text)) {
    for (const model::Utime utime : io::parse_date_times(text, stamps.string()))
      seconds.push_back(1e-6 * static_cast<double>(utime));
    return seconds;
  }
  io::NumberReader reader(text, stamps.string());
  while (const auto value = reader.next()) seconds.push_back(*value);
  return seconds;
}

/// The stamp of each file. If a KITTI drive lacks files but has all stamps, names are line numbers
/// from 0.
std::vector<double> seconds_of_files(const std::vector<CloudEntry>& files,
                                     const std::vector<double>& stamps) {
  if (files.size() == stamps.size()) return stamps;
  std::vector<double> seconds;
  for (const CloudEntry& file : files) {
    const std::optional<double> number = number_of(file);
    const bool is_line = number && *number >= 0.0 && *number == std::floor(*number) &&
                         *number < static_cast<double>(stamps.size());
    if (!is_line) return stamps;
    seconds.push_back(stamps[static_cast<std::size_t>(*number)]);
  }
  return seconds;
}

}  // namespace

std::vector<CloudEntry> find_cloud_sequence(const std::filesystem::path& folder, double rate_hz) {
  std::vector<CloudEntry> files = cloud_files(folder);
  const auto stamps = stamps_beside(folder);
  const std::vector<double> seconds = stamps ? seconds_of_files(files, seconds_in(*stamps))
                                             : seconds_of_names(files, folder, rate_hz);

  if (seconds.size() != files.size())
    throw io::DataError(fmt::format("{}: {} files for {} time stamps", folder.string(),
                                    files.size(), seconds.size()));
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!(seconds[i] >= 0.0 && seconds[i] < 9e9))
      throw io::DataError(fmt::format("{}: {} s is no time", files[i].path.string(), seconds[i]));
    files[i].utime = static_cast<model::Utime>(std::llround(seconds[i] * 1e6));
    if (i > 0 && files[i].utime <= files[i - 1].utime)
      throw io::DataError(fmt::format("{}: its time, {:.6f} s, is not behind that of {}",
                                      files[i].path.string(), seconds[i],
                                      files[i - 1].path.filename().string()));
  }
  return files;
}

}  // namespace understory::bag
