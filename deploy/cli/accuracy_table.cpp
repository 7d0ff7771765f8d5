#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "deploy/cli/accuracy_report.hpp"

namespace understory::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Of the table's first column.
constexpr int kNameWidth = 34;

/// `value` with `format`; a dash where there is none.
std::string cell(const Json& value, fmt::format_string<double> format) {
  return value.is_null() ? "-" : fmt::format(format, value.get<double>());
}

void print_row(const std::string& name, const std::string& text) {
  fmt::print("  {:<{}}{}\n", name, kNameWidth, text);
}

/// Calls `row` with the words and the key of the live poses and of the keyframes.
template <class Row>
void for_both(const Row& row) {
  row("live poses", "live");
  row("keyframes of the final map", "keyframes");
}

void print_drive(const Json& s) {
  const auto count = [&](const char* key) { return s[key].get<std::int64_t>(); };
  fmt::print("Drive\n");
  print_row("scans in the log", fmt::to_string(count("scans")));
  print_row("map updates", fmt::format("{} (not sure {}, rolled back {})", count("updates"),
                                       count("updates_not_sure"), count("updates_rolled_back")));
  print_row("messages that did not arrive",
            fmt::format("lost {}, malformed {}, dropped {} (and {} by the recorder)", count("lost"),
                        count("malformed"), count("dropped"), count("lost_by_the_log")));
  print_row("the map is tied to the world at", s["map_tied_at"].get<std::string>());
}

void print_positions(const Json& s) {
  const auto row = [&](const char* name, const char* mean, const char* rms, const char* largest,
                       const char* count) {
    const auto number = [&](const char* key) {
      return key == nullptr ? "" : fmt::format("{:.1f}", s[key].get<double>());
    };
    print_row(name, fmt::format("{:>10} {:>10} {:>10} {:>8}", number(mean), number(rms),
                                number(largest), s[count].get<std::int64_t>()));
  };

  fmt::print("\n{:<{}}{:>10} {:>10} {:>10} {:>8}\n", "Position error [cm], nothing aligned",
             kNameWidth + 2, "mean", "rms", "largest", "number");
  row("live poses", "live_mean_cm", "live_rmse_cm", "live_max_cm", "live_poses");
  row("keyframes of the final map", "rpe_cm", "keyframes_rmse_cm", "keyframes_max_cm", "keyframes");
  row("landmarks of the final map", "lpe_cm", nullptr, nullptr, "landmarks");
}

void print_ate(const Json& ate) {
  fmt::print("\n{:<{}}{:>10} {:>10} {:>10}\n", "ATE [m], after rigid alignment", kNameWidth + 2, "",
             "rms", "largest");
  for_both([&](const char* name, const char* key) {
    const Json& one = ate[key];
    const auto number = [&](const char* member) {
      return cell(one.is_null() ? Json() : one[member], "{:.3f}");
    };
    print_row(name, fmt::format("{:>10} {:>10} {:>10}", "", number("rms_m"), number("largest_m")));
  });
}

void print_rpe(const Json& rpe) {
  fmt::print("\n{:<{}}{:>10} {:>10} {:>10} {:>10} {:>10} {:>8}\n", "RPE over true path",
             kNameWidth + 2, "path [m]", "rms [m]", "mean [%]", "rms [deg]", "[deg/m]", "pairs");
  for_both([&](const char* name, const char* key) {
    for (const Json& one : rpe[key]) {
      print_row(name, fmt::format("{:>10} {:>10} {:>10} {:>10} {:>10} {:>8}",
                                  cell(one["length_m"], "{:.0f}"),
                                  cell(one["translation_rms_m"], "{:.3f}"),
                                  cell(one["translation_mean_percent"], "{:.3f}"),
                                  cell(one["rotation_rms_deg"], "{:.3f}"),
                                  cell(one["rotation_mean_deg_per_m"], "{:.5f}"),
                                  one["pairs"].get<std::int64_t>()));
    }
  });
}

void print_nees(const Json& nees) {
  fmt::print("\n{:<{}}{:>10} {:>10} {:>10} {:>10} {:>8}\n", "NEES, 3 degrees of freedom",
             kNameWidth + 2, "mean", "median", "in 95 %", "above it", "number");
  print_row("expected", fmt::format("{:>10} {:>10} {:>10} {:>10}", "3", "2.37", "95.0 %", "2.5 %"));
  for_both([&](const char* name, const char* key) {
    const Json& one = nees[key];
    if (one.is_null()) return print_row(name, fmt::format("{:>10}", "-"));
    const auto percent = [&](const char* member) {
      return fmt::format("{:.1f} %", 100.0 * one[member].get<double>());
    };
    print_row(name,
              fmt::format("{:>10.2f} {:>10.2f} {:>10} {:>10} {:>8}", one["mean"].get<double>(),
                          one["median"].get<double>(), percent("share_in_95_band"),
                          percent("share_above_95_band"), one["poses"].get<std::int64_t>()));
  });
}

}  // namespace

void print_accuracy(const Json& summary) {
  print_drive(summary);
  print_positions(summary);
  print_ate(summary["ate"]);
  print_rpe(summary["rpe_by_path"]);
  print_nees(summary["nees"]);
}

}  // namespace understory::cli
