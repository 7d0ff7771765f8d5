#include "eval/experiments/existence/protocol.hpp"

#include <limits>
#include <utility>

#include "eval/experiments/existence/own_methods.hpp"
#include "eval/experiments/existence/peer_methods.hpp"
#include "eval/experiments/existence/references.hpp"

namespace understory::eval::experiments::existence {
namespace {

/// A point is in the map from so many sightings in one drive on, a tenth of its looks: what false
/// sightings alone make is not.
constexpr int kMappedFrom = 5;
constexpr int kMappedShare = 10;

using Grid = std::vector<std::vector<double>>;

/// All combinations.
Grid product(const Grid& choices) {
  Grid all{{}};
  for (const std::vector<double>& values : choices) {
    Grid longer;
    for (const std::vector<double>& begun : all) {
      for (const double value : values) {
        longer.push_back(begun);
        longer.back().push_back(value);
      }
    }
    all = std::move(longer);
  }
  return all;
}

double objective(const TunedMethod& method, const std::vector<History>& training) {
  double sum = 0.0;
  for (const History& history : training)
    for (const AfterDrive& after : run_method(method, history))
      sum += roc_area(after.scored) - brier_score(after.scored);
  return sum;
}

}  // namespace

void feed(Method& method, const History& history, std::size_t first, std::size_t last) {
  for (std::size_t k = first; k <= last; ++k) {
    method.begin_drive(history.drives[k].time_s);
    for (const LookEvent& event : history.drives[k].looks) method.look(event);
    method.end_drive();
  }
}

std::vector<bool> mapped_points(const History& history) {
  std::vector<bool> mapped(history.points_m.size(), false);
  for (std::size_t k = 0; k < history.mapping_drives; ++k) {
    std::vector<int> looks(mapped.size(), 0), seen(mapped.size(), 0);
    for (const LookEvent& event : history.drives[k].looks) {
      ++looks[event.point];
      seen[event.point] += event.is_seen ? 1 : 0;
    }
    for (std::size_t i = 0; i < mapped.size(); ++i)
      if (seen[i] >= kMappedFrom && kMappedShare * seen[i] >= looks[i]) mapped[i] = true;
  }
  return mapped;
}

std::vector<AfterDrive> run_method(const TunedMethod& method, const History& history) {
  const std::vector<bool> mapped = mapped_points(history);
  std::vector<bool> scored(mapped.size(), false);
  const auto running = method.make(history, method.tuned);
  feed(*running, history, 0, history.mapping_drives - 1);

  std::vector<AfterDrive> results;
  for (std::size_t k = history.mapping_drives; k < history.drives.size(); ++k) {
    feed(*running, history, k, k);
    AfterDrive after;
    for (std::size_t i = 0; i < mapped.size(); ++i) {
      const PointTruth& truth = history.drives[k].truth[i];
      if (!mapped[i]) continue;
      if (truth.is_scored) scored[i] = true;
      const ScoredPoint point{running->probability(i), truth.exists};
      (scored[i] ? after.scored : after.rest).push_back(point);
      if (truth.is_hidden) after.hidden.push_back(point);
    }
    results.push_back(std::move(after));
  }
  return results;
}

TunedMethod tune(const MethodKind& kind, const std::vector<History>& training) {
  TunedMethod best{kind.name, kind.make, {}};
  double most = -std::numeric_limits<double>::infinity();
  for (const std::vector<double>& values : kind.grid) {
    const TunedMethod method{kind.name, kind.make, values};
    const double reached = kind.grid.size() > 1 ? objective(method, training) : 0.0;
    if (reached <= most) continue;
    most = reached;
    best = method;
  }
  return best;
}

std::vector<MethodKind> method_kinds(const std::vector<History>& training) {
  const std::vector<double> recalls{0.3, 0.5, 0.7, 0.9}, false_rates{0.01, 0.05, 0.1};
  const std::vector<double> rates{0.05, 0.25, 1.0};
  const Grid own = product({{0.05, 0.25}, {2.0, 20.0}, {0.7}, {4.0}});
  Grid perpetua;
  for (const double recall : recalls)
    for (const double false_rate : false_rates)
      perpetua.push_back(perpetua_by_em(training, recall, false_rate));

  return {{"no removal", make_no_removal, {}},
          {"log-odds counter", make_counter, product({recalls, false_rates, {3.5, 7.0, 14.0}})},
          {"persistence filter", make_persistence, product({recalls, false_rates, rates})},
          {"joint persistence filter", make_joint,
           product({recalls, {0.01, 0.1}, rates, {0.1, 0.5, 1.0}})},
          {"Perpetua", make_perpetua, perpetua},
          {"thesis's rules", make_thesis, product({{0.5, 0.7, 0.9}, {0.05, 0.1, 0.3}})},
          {"icosahedral", make_icosahedral, own},
          {"icosahedral, neighbours", make_neighbours, own},
          {"von Mises-Fisher", make_von_mises_fisher, own},
          {"icosahedral, no decay", make_no_decay, own},
          {"icosahedral, no redundancy control", make_no_redundancy, own},
          {"icosahedral, looks alone", make_one_level, own},
          {"icosahedral, recall as told", make_told_recall, own},
          {"true rates", make_true_rates, {}},
          {"ideal", make_ideal, {}}};
}

}  // namespace understory::eval::experiments::existence
