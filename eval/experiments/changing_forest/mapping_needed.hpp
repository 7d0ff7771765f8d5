// eval existence-needed: whether a drive in an old map says that mapping is needed, on the bus.
#pragma once

#include <CLI/App.hpp>
#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "eval/experiments/changing_forest/changing_forest.hpp"

namespace understory::eval::experiments::changing_forest {

/// A drive in the map of an earlier one: what happened between them, and what is in the way.
struct NeedSetting {
  std::string name;
  Part part = Part::kChanges;
  double changed = 0.0;      ///< Share of the trees that were felled; as many are new.
  double false_share = 0.0;  ///< Of all detections.
  /// What is there in the way or seen falsely is no reason to map again.
  bool is_changed() const { return changed > 0.0; }
};

/// What EXISTENCE said at most on one drive: of `missing_share`, of `new_share`, and of their sum.
struct NeedScore {
  NeedSetting setting;
  std::uint64_t seed = 0;
  std::array<double, 3> most{};
  double needed_pct = 0.0;  ///< Of the keyframes: `mapping_needed`.
};

/// What EXISTENCE said at most, and how often it asked for mapping.
NeedScore need_of(const NeedSetting& setting, std::uint64_t seed,
                  std::span<const harness::MappingSignal> signals);

/// Areas under the ROC of the three signals: drives of which a share of the trees changed against
/// those where none did, first without those whose detections are false, then with them.
nlohmann::json need_areas(std::span<const NeedScore> scores);

/// Adds `existence-needed`.
void add_mapping_needed_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::changing_forest
