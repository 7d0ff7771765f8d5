#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/terminal/printable.hpp"
#include "deploy/cli/accuracy_report.hpp"

namespace understory::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Width of the table's first column.
constexpr int kNameWidth = 36;

/// `value` with `format`; a dash = no value.
std::string number_or_dash(const Json& value, fmt::format_string<double> format) {
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
      return key == nullptr ? "" : number_or_dash(s[key], "{:.1f}");
    };
    print_row(name, fmt::format("{:>10} {:>10} {:>10} {:>8}", number(mean), number(rms),
                                number(largest), s[count].get<std::int64_t>()));
  };

  fmt::print("\n{:<{}}{:>10} {:>10} {:>10} {:>8}\n", "Position error [cm], nothing aligned",
             kNameWidth + 2, "mean", "rms", "largest", "number");
  row("live poses", "live_mean_cm", "live_rmse_cm", "live_max_cm", "live_poses");
  row("keyframes of the final map", "rpe_cm", "keyframes_rmse_cm", "keyframes_max_cm", "keyframes");
  row("landmarks of the final map", "lpe_cm", nullptr, nullptr, "landmarks_compared");
  const auto left_out =
      s["landmarks"].get<std::int64_t>() - s["landmarks_compared"].get<std::int64_t>();
  if (left_out > 0) {
    print_row("landmarks not compared",
              fmt::format("{} (no true landmarks, or not seen in a given map)", left_out));
  }
}

void print_ate(const Json& ate) {
  fmt::print("\n{:<{}}{:>10} {:>10} {:>10}\n", "ATE [m], after rigid alignment", kNameWidth + 2, "",
             "rms", "largest");
  for_both([&](const char* name, const char* key) {
    const Json& one = ate[key];
    const auto number = [&](const char* member) {
      return number_or_dash(one.is_null() ? Json() : one[member], "{:.3f}");
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
                                  number_or_dash(one["length_m"], "{:.0f}"),
                                  number_or_dash(one["translation_rms_m"], "{:.3f}"),
                                  number_or_dash(one["translation_mean_percent"], "{:.3f}"),
                                  number_or_dash(one["rotation_rms_deg"], "{:.3f}"),
                                  number_or_dash(one["rotation_mean_deg_per_m"], "{:.5f}"),
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

/// "NAME COUNT" of each, joined; zero counts are left out.
std::string listed(const Json& counts) {
  std::string text;
  for (const auto& [name, count] : counts.items()) {
    if (count.get<std::int64_t>() == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", terminal::printable(name),
                        count.get<std::int64_t>());
  }
  return text.empty() ? "none" : text;
}

void print_closures(const Json& closures) {
  const auto count = [&](const char* key) { return closures[key].get<std::int64_t>(); };
  print_row("loop closures",
            fmt::format("sent {}, accepted {}, waiting {}, revoked {}, refused {}", count("sent"),
                        count("accepted"), count("waiting"), count("revoked"), count("refused")));
  if (count("refused") > 0) print_row("refused because", listed(closures["refused_by_reason"]));
}

void print_wrong(const Json& wrong) {
  const auto count = wrong["stretches"].get<std::int64_t>();
  std::string text = fmt::format("{} with {} poses", count, wrong["poses"].get<std::int64_t>());
  if (count == 0) {
    text = "none";
  } else if (!wrong["told"].is_null()) {
    text += fmt::format("; a process was not OK within 10 s at {} of them",
                        wrong["told"].get<std::int64_t>());
  } else {
    text += "; neither HEALTH nor LOG in the log";
  }
  print_row("stretches over 1 m and 3 sigma off", text);
}

void print_counts(const Json& counts, const Json& doubles) {
  fmt::print("\nCounts\n");
  print_row("live poses by status", listed(counts["poses_by_status"]));
  print_row("keyframes without a pose",
            fmt::format("{} (KEYFRAME in the log: {})",
                        counts["keyframes_without_pose"].get<std::int64_t>(),
                        counts["keyframes_sent"].get<std::int64_t>()));
  print_row("steps of reset_counter",
            fmt::to_string(counts["reset_counter_steps"].get<std::int64_t>()));
  print_closures(counts["closures"]);
  print_wrong(counts["wrong"]);
  if (!doubles.is_null()) {
    print_row("pairs of landmarks at one true one",
              fmt::format("{} ({} landmarks lie within 0.5 m of a true one)",
                          doubles["pairs"].get<std::int64_t>(),
                          doubles["at_a_true_one"].get<std::int64_t>()));
  }
}

/// Prints the channels with the most bytes.
void print_bytes(const Json& channels) {
  constexpr std::size_t kShown = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, channels.size()); ++i) {
    text += fmt::format("{}{} {:.2f} MB", text.empty() ? "" : ", ",
                        terminal::printable(channels[i]["channel"].get<std::string>()),
                        1e-6 * channels[i]["bytes"].get<double>());
  }
  print_row("largest channels", text.empty() ? "none" : text);
}

}  // namespace

void print_accuracy(const Json& summary) {
  print_drive(summary);
  print_positions(summary);
  print_ate(summary["ate"]);
  print_rpe(summary["rpe_by_path"]);
  print_nees(summary["nees"]);
  print_counts(summary["counts"], summary["doubles"]);
  print_bytes(summary["bytes_by_channel"]);
}

}  // namespace understory::cli
