#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <random>
#include <utility>

#include "common/existence/icosahedral_shell.hpp"
#include "eval/experiments/existence/parts.hpp"
#include "eval/experiments/existence/worlds.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::existence {
namespace {

namespace existence_model = understory::existence;

constexpr std::uint64_t kTrainingSeed = 100001;

void append(std::vector<ScoredPoint>& all, const std::vector<ScoredPoint>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// Each run's history through a method, the drives' answers of all runs together.
std::vector<AfterDrive> pooled(const TunedMethod& method, const std::vector<History>& histories) {
  std::vector<AfterDrive> all;
  for (const History& history : histories) {
    const std::vector<AfterDrive> one = run_method(method, history);
    all.resize(std::max(all.size(), one.size()));
    for (std::size_t k = 0; k < one.size(); ++k) {
      append(all[k].scored, one[k].scored);
      append(all[k].rest, one[k].rest);
      append(all[k].hidden, one[k].hidden);
    }
  }
  return all;
}

template <typename Make>
std::vector<History> make_histories(const ExistenceRun& run, const WorldSetting& setting,
                                    const Make& make) {
  std::vector<History> histories(static_cast<std::size_t>(run.runs));
  tools::run_in_parallel(histories.size(), run.jobs, "worlds", run.stop,
                         [&](std::size_t i) { histories[i] = make(setting, run.seed + i); });
  return histories;
}

nlohmann::json measures_of(const AfterDrive& after) {
  return {{"points", after.scored.size()},
          {"auc", roc_area(after.scored)},
          {"average_precision", average_precision(after.scored)},
          {"brier", brier_score(after.scored)},
          {"found_at_1_pct", 100.0 * found_at(after.scored, 0.01)},
          {"wrongly_removed_pct", 100.0 * removed_share(after.scored, true)},
          {"gone_removed_pct", 100.0 * removed_share(after.scored, false)},
          {"hidden_points", after.hidden.size()},
          {"hidden_removed_pct", 100.0 * removed_share(after.hidden, true)},
          {"rest_auc", roc_area(after.rest)}};
}

nlohmann::json curves_of(const AfterDrive& after) {
  nlohmann::json bins = nlohmann::json::array();
  for (const ReliabilityBin& bin : reliability(after.scored))
    bins.push_back({{"stated", bin.stated}, {"frequency", bin.frequency}, {"count", bin.count}});
  return {{"roc", roc_curve(after.scored)}, {"reliability", bins}};
}

void print_world(const nlohmann::json& row) {
  fmt::print("{:<36} {:>5.0f} {:>5.0f} {:>3} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7}\n",
             row["method"].get<std::string>(), row["changed_pct"].get<double>(),
             row["missed_pct"].get<double>(), row["drives"].get<int>(), shown(row, "auc", 4),
             shown(row, "average_precision"), shown(row, "brier", 4),
             shown(row, "found_at_1_pct", 1), shown(row, "wrongly_removed_pct", 2),
             shown(row, "gone_removed_pct", 1), shown(row, "hidden_removed_pct", 1));
  std::fflush(stdout);
}

void run_world(ExistenceRun& run, const WorldSetting& setting, bool is_drawn) {
  const std::vector<History> histories = make_histories(run, setting, make_history);
  std::vector<std::vector<AfterDrive>> results(run.methods.size());
  tools::run_in_parallel(results.size(), run.jobs, "methods", run.stop,
                         [&](std::size_t i) { results[i] = pooled(run.methods[i], histories); });
  for (std::size_t i = 0; i < results.size(); ++i) {
    for (const std::size_t drives : {std::size_t{1}, results[i].size()}) {
      nlohmann::json row = measures_of(results[i][drives - 1]);
      row.update({{"part", "worlds"},
                  {"method", run.methods[i].name},
                  {"changed_pct", 100.0 * setting.changed},
                  {"missed_pct", 100.0 * setting.pass_missed},
                  {"drives", drives}});
      print_world(row);
      run.rows.push_back(std::move(row));
    }
    if (is_drawn) run.traces["curves"][run.methods[i].name] = curves_of(results[i].front());
  }
}

nlohmann::json trap_row(const TunedMethod& method, const std::vector<History>& histories,
                        const WorldSetting& setting, const char* part) {
  std::vector<ScoredPoint> hidden, all;
  for (const AfterDrive& after : pooled(method, histories)) {
    append(hidden, after.hidden);
    append(all, after.scored);
    append(all, after.rest);
  }
  return {{"part", part},
          {"method", method.name},
          {"has_ranges", setting.has_ranges},
          {"gap_days", setting.gap_days},
          {"points", all.size()},
          {"hidden_points", hidden.size()},
          {"hidden_removed_pct", 100.0 * removed_share(hidden, true)},
          {"gone_removed_pct", 100.0 * removed_share(all, false)},
          {"wrongly_removed_pct", 100.0 * removed_share(all, true)}};
}

template <typename Make>
void run_trap(ExistenceRun& run, const char* part, double gap_days, const Make& make) {
  for (const bool has_ranges : {false, true}) {
    WorldSetting setting;
    setting.has_ranges = has_ranges;
    setting.gap_days = gap_days;
    const std::vector<History> histories = make_histories(run, setting, make);
    for (const TunedMethod& method : run.methods) {
      nlohmann::json row = trap_row(method, histories, setting, part);
      fmt::print("{:<15} {:>2.0f} days {:<9} {:<36} hidden removed {:>6} %, gone removed {:>6} %\n",
                 part, gap_days, has_ranges ? "ranges" : "no ranges", method.name,
                 shown(row, "hidden_removed_pct", 2), shown(row, "gone_removed_pct", 1));
      run.rows.push_back(std::move(row));
    }
  }
}

/// Points that are born, 20 looks each, then the next pass: what is kept.
nlohmann::json births_row(double false_share, std::uint64_t seed) {
  constexpr int kBirths = 5000;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  existence_model::ExistenceModel model;
  int kept_false = 0, kept = 0, real = 0, kept_real = 0;
  for (int i = 0; i < kBirths; ++i) {
    const bool is_real = unit(random) >= false_share;
    const double turn = 6.28 * unit(random);
    const auto look_at = [&](int k) {
      const double bearing = turn + 0.08 * k;
      return existence_model::Look{{static_cast<float>(12.0 * std::cos(bearing)),
                                    static_cast<float>(12.0 * std::sin(bearing)), 0.5F}};
    };
    auto point =
        existence_model::PointExistence<existence_model::IcosahedralShell>::born(model, look_at(0));
    for (int k = 1; k < 20; ++k) {
      const bool is_seen = unit(random) < 0.01 || (is_real && unit(random) < 0.8);
      is_seen ? point.hit(model, look_at(k)) : point.miss(model, look_at(k));
    }
    const bool is_kept = point.probability() > 0.5;
    kept += is_kept ? 1 : 0;
    real += is_real ? 1 : 0;
    kept_false += is_kept && !is_real ? 1 : 0;
    kept_real += is_kept && is_real ? 1 : 0;
  }
  return {{"part", "births"},
          {"false_pct", 100.0 * false_share},
          {"births", kBirths},
          {"false_in_map_pct", 100.0 * kept_false / std::max(1, kept)},
          {"real_kept_pct", 100.0 * kept_real / std::max(1, real)}};
}

}  // namespace

std::string shown(const nlohmann::json& row, const char* key, int digits) {
  return fmt::format("{:.{}f}", row[key].get<double>(), digits);
}

std::vector<History> training_histories() {
  std::vector<History> training;
  for (const double changed : {0.05, 0.2, 0.5}) {
    for (const std::uint64_t more : {0, 1}) {
      WorldSetting setting;
      setting.changed = changed;
      training.push_back(make_history(setting, kTrainingSeed + more));
    }
  }
  return training;
}

void run_worlds(ExistenceRun& run) {
  fmt::print("{:<36} {:>5} {:>5} {:>3} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7}\n", "method",
             "gone%", "miss%", "dr", "AUC", "AP", "Brier", "found@1", "wrong%", "found%",
             "hidden%");
  for (const double missed : {0.0, 0.05}) {
    for (const double changed : {0.05, 0.1, 0.2, 0.3, 0.5}) {
      WorldSetting setting;
      setting.changed = changed;
      setting.pass_missed = missed;
      run_world(run, setting, changed == 0.2 && missed == 0.05);
    }
  }
  WorldSetting setting;
  setting.pass_missed = 0.36;
  run_world(run, setting, false);
}

void run_traps(ExistenceRun& run) {
  for (const double gap_days : {1.0, 30.0})
    run_trap(run, "occlusion-trap", gap_days, make_occlusion_trap);
  run_trap(run, "clear-cut", 30.0, make_clear_cut);
}

void run_false_sightings(ExistenceRun& run) {
  for (const double false_rate : {0.001, 0.01, 0.05}) {
    WorldSetting setting;
    setting.false_rate = false_rate;
    const std::vector<History> histories = make_histories(run, setting, make_history);
    for (const TunedMethod& method : run.methods) {
      if (method.name != "icosahedral" && method.name != "thesis's rules") continue;
      nlohmann::json row = measures_of(pooled(method, histories).back());
      row.update({{"part", "false-sightings"},
                  {"method", method.name},
                  {"false_rate_pct", 100.0 * false_rate}});
      fmt::print("false sightings {:.1f} %: {:<16} AUC {}, gone removed {} %\n", 100.0 * false_rate,
                 method.name, shown(row, "auc", 4), shown(row, "gone_removed_pct", 1));
      run.rows.push_back(std::move(row));
    }
  }
  for (const double share : {0.1, 0.3}) {
    run.rows.push_back(births_row(share, run.seed));
    fmt::print("births, {:.0f} % false: {} % of the map false, {} % of the real kept\n",
               100.0 * share, shown(run.rows.back(), "false_in_map_pct", 2),
               shown(run.rows.back(), "real_kept_pct", 1));
  }
}

void trace_shell(ExistenceRun& run) {
  using Point = existence_model::PointExistence<existence_model::IcosahedralShell>;
  const History history = make_history({}, run.seed);
  existence_model::ExistenceModel model;
  // The point with most looks that a wall hides.
  std::vector<int> hidden(history.points_m.size(), 0);
  for (const LookEvent& event : history.drives.front().looks)
    hidden[event.point] += event.is_clear ? 0 : 1;
  const auto chosen =
      static_cast<std::uint32_t>(std::max_element(hidden.begin(), hidden.end()) - hidden.begin());

  Point point = Point::known(model);
  nlohmann::json stages = nlohmann::json::array();
  for (std::size_t k = 0; k < history.drives.size(); ++k) {
    if (k > 0) model.begin_pass();
    for (const LookEvent& event : history.drives[k].looks) {
      if (event.point != chosen) continue;
      event.is_seen ? point.hit(model, event.look) : point.miss(model, event.look);
    }
    nlohmann::json visible = nlohmann::json::array(), reach = nlohmann::json::array();
    for (int face = 0; face < existence_model::kFaces; ++face)
      visible.push_back(point.shell().face_visibility(face));
    for (int vertex = 0; vertex < existence_model::kVertices; ++vertex)
      reach.push_back(point.shell().vertex_reach_m(vertex));
    stages.push_back(
        {{"probability", point.probability()}, {"visibility", visible}, {"reach_m", reach}});
  }
  nlohmann::json vertices = nlohmann::json::array(), faces = nlohmann::json::array();
  for (int vertex = 0; vertex < existence_model::kVertices; ++vertex) {
    const Eigen::Vector3d at = existence_model::icosahedron_vertex(vertex);
    vertices.push_back({at.x(), at.y(), at.z()});
  }
  for (const auto& face : existence_model::kIcosahedron) faces.push_back(face.vertices);
  run.traces["shell"] = {{"vertices", vertices}, {"faces", faces}, {"stages", stages}};
}

}  // namespace understory::eval::experiments::existence
