#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "eval/experiments/existence/camera/camera_rows.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

/// From this share of changed things on a map should be made anew.
constexpr double kMuchChanged = 0.2;

struct SignalKind {
  const char* name;
  double (*value)(const MappingSignal&);
};

const std::array<SignalKind, 4> kSignals{
    {{"points missed", [](const MappingSignal& signal) { return signal.missed_points; }},
     {"keypoints without a point",
      [](const MappingSignal& signal) { return signal.keypoints_without; }},
     {"both", [](const MappingSignal& signal) { return signal.both(); }},
     {"mean of 1 - P", [](const MappingSignal& signal) { return signal.doubt; }}}};

/// Which drives are compared with those through unchanged worlds.
struct Selection {
  std::string world;  ///< Empty: all.
  double from = 0.2;  ///< Shares of change.
  double to = 1.0;
  bool is_first_alone = true;  ///< The first drive after the change.
  bool has_occluded = true;    ///< Those that new occluders alone stand in are unchanged, too.
};

/// A drive without change "exists"; P is the signal's opposite.
std::vector<ScoredPoint> drives_of(const std::vector<CaseResult>& cases, const SignalKind& kind,
                                   const Selection& selection) {
  std::vector<ScoredPoint> drives;
  for (const CaseResult& one : cases) {
    const double changed = one.setting.changed;
    const bool is_changed = changed > 0.0;
    if (!selection.world.empty() && name_of_world(one.setting) != selection.world) continue;
    if (one.setting.has_occluders_alone && !selection.has_occluded) continue;
    if (is_changed && (changed < selection.from - 1e-9 || changed > selection.to + 1e-9)) continue;
    for (std::size_t k = 0; k < one.signals.size(); ++k)
      if (k == 0 || !is_changed || !selection.is_first_alone)
        drives.push_back({-kind.value(one.signals[k]), !is_changed});
  }
  return drives;
}

struct MeanSignal {
  double sum = 0.0;
  double count = 0.0;
  double mean() const { return count == 0.0 ? 0.0 : sum / count; }
};

std::optional<nlohmann::json> area_row(const std::vector<CaseResult>& cases, const SignalKind& kind,
                                       const Selection& selection) {
  const std::vector<ScoredPoint> drives = drives_of(cases, kind, selection);
  MeanSignal changed, unchanged;
  for (const ScoredPoint& drive : drives) {
    MeanSignal& mean = drive.exists ? unchanged : changed;
    mean.sum -= drive.probability;
    mean.count += 1.0;
  }
  if (changed.count == 0.0 || unchanged.count == 0.0) return std::nullopt;
  const double area = roc_area(drives);
  return nlohmann::json{{"part", "mapping-needed"},
                        {"world", selection.world.empty() ? "all" : selection.world},
                        {"with_occluded", selection.has_occluded},
                        {"signal", kind.name},
                        {"from_pct", 100.0 * selection.from},
                        {"to_pct", 100.0 * selection.to},
                        {"drives", selection.is_first_alone ? "first" : "all"},
                        {"changed_drives", changed.count},
                        {"unchanged_drives", unchanged.count},
                        {"auc", area},
                        {"auc_half95", 1.96 * sigma_of_area(area, changed.count, unchanged.count)},
                        {"mean_changed", changed.mean()},
                        {"mean_unchanged", unchanged.mean()}};
}

std::vector<Selection> selections(const std::vector<CaseResult>& cases) {
  std::set<std::string> worlds;
  std::set<double> shares;
  for (const CaseResult& one : cases) {
    worlds.insert(name_of_world(one.setting));
    if (one.setting.changed > 0.0) shares.insert(one.setting.changed);
  }
  std::vector<Selection> all{{"", kMuchChanged, 1.0, true, false},
                             {"", kMuchChanged, 1.0, true, true},
                             {"", kMuchChanged, 1.0, false, true}};
  for (const std::string& world : worlds) all.push_back({world, kMuchChanged, 1.0, true, true});
  for (const double share : shares) all.push_back({"", share, share, true, true});
  return all;
}

}  // namespace

nlohmann::json mapping_needed_rows(const std::vector<CaseResult>& cases) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Selection& selection : selections(cases))
    for (const SignalKind& kind : kSignals)
      if (auto row = area_row(cases, kind, selection)) rows.push_back(std::move(*row));
  return rows;
}

nlohmann::json mapping_needed_curves(const std::vector<CaseResult>& cases) {
  nlohmann::json curves;
  for (const SignalKind& kind : kSignals) {
    curves[kind.name]["much"] =
        roc_curve(drives_of(cases, kind, {"", kMuchChanged, 1.0, true, true}));
    curves[kind.name]["little"] =
        roc_curve(drives_of(cases, kind, {"", 0.0, kMuchChanged - 0.01, true, true}));
  }
  return curves;
}

}  // namespace understory::eval::experiments::existence::camera
