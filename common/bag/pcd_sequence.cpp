#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "common/bag/pcd_file.hpp"
#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"

namespace understory::bag {
namespace {

/// Seconds that a number in a file's name means: those since 1970 have ten digits, and three more
/// for each finer unit.
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

std::vector<double> seconds_of_names(std::vector<PcdEntry>& files,
                                     const std::filesystem::path& folder, double rate_hz) {
  std::vector<std::pair<double, PcdEntry>> numbered;
  for (PcdEntry& file : files) {
    const std::string stem = file.path.stem().string();
    io::NumberReader reader(stem, file.path.string());
    numbered.emplace_back(reader.require("a time as the file's name"), file);
  }
  std::ranges::stable_sort(numbered, {}, &std::pair<double, PcdEntry>::first);

  std::vector<double> numbers;
  for (std::size_t i = 0; i < files.size(); ++i) {
    files[i] = numbered[i].second;
    numbers.push_back(numbered[i].first);
  }
  if (is_counting(numbers) && rate_hz <= 0.0)
    throw io::DataError(fmt::format(
        "{}: names that count {:g} to {:g} are no times; --rate HZ states how many files a second "
        "has, timestamps.txt their times",
        folder.string(), numbers.front(), numbers.back()));
  for (double& number : numbers) number = rate_hz > 0.0 ? number / rate_hz : seconds_of(number);
  return numbers;
}

}  // namespace

std::vector<PcdEntry> find_pcd_sequence(const std::filesystem::path& folder, double rate_hz) {
  std::vector<PcdEntry> files;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".pcd") files.push_back({0, entry.path()});
  }
  if (failed || files.empty())
    throw io::DataError(fmt::format("{}: no folder with .pcd files", folder.string()));

  std::ranges::sort(files, {}, &PcdEntry::path);
  std::vector<double> seconds;
  const std::filesystem::path stamps = folder / "timestamps.txt";
  if (std::filesystem::exists(stamps, failed)) {
    const std::string text = io::RecordingFolder(folder).read("timestamps.txt");
    io::NumberReader reader(text, stamps.string());
    while (const auto value = reader.next()) seconds.push_back(*value);
  } else {
    seconds = seconds_of_names(files, folder, rate_hz);
  }

  if (seconds.size() != files.size())
    throw io::DataError(fmt::format("{}: {} files for {} time stamps", folder.string(),
                                    files.size(), seconds.size()));
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!(seconds[i] >= 0.0 && seconds[i] < 9e9))
      throw io::DataError(fmt::format("{}: {} s is no time", files[i].path.string(), seconds[i]));
    files[i].utime = static_cast<model::Utime>(std::llround(seconds[i] * 1e6));
  }
  std::ranges::stable_sort(files, {}, &PcdEntry::utime);
  return files;
}

}  // namespace understory::bag
