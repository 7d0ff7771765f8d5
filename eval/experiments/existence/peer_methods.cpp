#include "eval/experiments/existence/peer_methods.hpp"

#include <cmath>

#include "eval/experiments/existence/peers/joint_persistence.hpp"
#include "eval/experiments/existence/peers/log_odds_counter.hpp"
#include "eval/experiments/existence/peers/persistence_filter.hpp"

namespace understory::eval::experiments::existence {
namespace {

constexpr double kPeerMonth_s = 30.0 * 86400.0;

class CounterMethod : public Method {
 public:
  CounterMethod(std::size_t points, const peers::LogOddsCounter& counter)
      : counters_(points, counter) {}
  void begin_drive(double) override {}
  void look(const LookEvent& event) override { counters_[event.point].update(event.is_seen); }
  double probability(std::size_t point) const override { return counters_[point].probability(); }

 private:
  std::vector<peers::LogOddsCounter> counters_;
};

class PersistenceMethod : public Method {
 public:
  PersistenceMethod(const History& history, const std::vector<double>& tuned)
      : missed_(1.0 - tuned[0]),
        false_rate_(tuned[1]),
        filters_(history.points_m.size(), peers::PersistenceFilter(tuned[2] / kPeerMonth_s, 0.0)) {}
  void begin_drive(double time_s) override { time_s_ = time_s; }
  void look(const LookEvent& event) override {
    filters_[event.point].observe(time_s_, event.is_seen, missed_, false_rate_);
  }
  double probability(std::size_t point) const override { return filters_[point].predict(time_s_); }

 private:
  double missed_;
  double false_rate_;
  std::vector<peers::PersistenceFilter> filters_;
  double time_s_ = 0.0;
};

class JointMethod : public PersistenceMethod {
 public:
  JointMethod(const History& history, const std::vector<double>& tuned)
      : PersistenceMethod(history, tuned),
        neighbours_(peers::neighbours_of(history.points_m, 6, 10.0F)),
        coupling_(tuned[3]),
        beliefs_(history.points_m.size(), 1.0) {}
  void end_drive() override {
    std::vector<double> own;
    for (std::size_t i = 0; i < beliefs_.size(); ++i)
      own.push_back(PersistenceMethod::probability(i));
    beliefs_ = peers::joint_beliefs(own, neighbours_, coupling_);
  }
  double probability(std::size_t point) const override { return beliefs_[point]; }

 private:
  std::vector<std::vector<std::uint32_t>> neighbours_;
  double coupling_;
  std::vector<double> beliefs_;
};

class PerpetuaMethod : public Method {
 public:
  PerpetuaMethod(const History& history, const std::vector<double>& tuned)
      : missed_(1.0 - tuned[0]), false_rate_(tuned[1]) {
    const peers::RateMixture persistence{{tuned[2] / kPeerMonth_s, tuned[3] / kPeerMonth_s},
                                         {tuned[4], 1.0 - tuned[4]}};
    const peers::RateMixture emergence{{tuned[5] / kPeerMonth_s}, {1.0}};
    features_.assign(history.points_m.size(), peers::Perpetua(persistence, emergence, 0.0));
  }
  void begin_drive(double time_s) override { time_s_ = time_s; }
  void look(const LookEvent& event) override {
    features_[event.point].update(time_s_, event.is_seen, missed_, false_rate_);
  }
  double probability(std::size_t point) const override { return features_[point].predict(time_s_); }

 private:
  double missed_;
  double false_rate_;
  std::vector<peers::Perpetua> features_;
  double time_s_ = 0.0;
};

/// What the drives of a history saw of each point.
void add_sightings(const History& history, double recall, double false_rate,
                   std::vector<std::vector<peers::SightingsOfDrive>>& features) {
  const std::size_t first = features.size();
  features.resize(first + history.points_m.size());
  for (const DriveLooks& drive : history.drives) {
    for (std::size_t i = first; i < features.size(); ++i)
      features[i].push_back({drive.time_s, 0.0, 0.0});
    for (const LookEvent& event : drive.looks) {
      peers::SightingsOfDrive& of_drive = features[first + event.point].back();
      of_drive.log_if_there += std::log(event.is_seen ? recall : 1.0 - recall);
      of_drive.log_if_gone += std::log(event.is_seen ? false_rate : 1.0 - false_rate);
    }
  }
}

}  // namespace

std::unique_ptr<Method> make_counter(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<CounterMethod>(history.points_m.size(),
                                         peers::LogOddsCounter(tuned[0], tuned[1], tuned[2]));
}
std::unique_ptr<Method> make_persistence(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<PersistenceMethod>(history, tuned);
}
std::unique_ptr<Method> make_joint(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<JointMethod>(history, tuned);
}
std::unique_ptr<Method> make_perpetua(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<PerpetuaMethod>(history, tuned);
}

std::vector<double> perpetua_by_em(const std::vector<History>& training, double recall,
                                   double false_rate) {
  std::vector<std::vector<peers::SightingsOfDrive>> features;
  for (const History& history : training) add_sightings(history, recall, false_rate, features);
  peers::RateMixture mixture{{1.0 / kPeerMonth_s, 0.05 / kPeerMonth_s}, {0.5, 0.5}};
  for (int step = 0; step < 30; ++step) mixture = peers::em_step(mixture, features);
  // Nothing comes back in the training worlds: the rate of emergence is a tenth of the slower rate.
  const double fast = mixture.rates_per_s[0] * kPeerMonth_s;
  const double slow = mixture.rates_per_s[1] * kPeerMonth_s;
  return {recall, false_rate, fast, slow, mixture.weights[0], 0.1 * std::min(fast, slow)};
}

}  // namespace understory::eval::experiments::existence
