#include "eval/experiments/existence/references.hpp"

#include <cmath>

#include "common/existence/odds.hpp"

namespace understory::eval::experiments::existence {
namespace {

class NoRemoval : public Method {
 public:
  void begin_drive(double) override {}
  void look(const LookEvent&) override {}
  double probability(std::size_t) const override { return 1.0; }
};

class Ideal : public Method {
 public:
  explicit Ideal(const History& history) : history_(history) {}
  void begin_drive(double) override { ++drives_; }
  void look(const LookEvent&) override {}
  double probability(std::size_t point) const override {
    return history_.drives[drives_ - 1].truth[point].exists ? 1.0 : 0.0;
  }

 private:
  const History& history_;
  std::size_t drives_ = 0;
};

class TrueRates : public Method {
 public:
  explicit TrueRates(const History& history)
      : history_(history),
        odds_(history.points_m.size(), kSure),
        there_(history.points_m.size(), 1.0) {}

  void begin_drive(double) override {
    if (++drives_ != history_.mapping_drives + 1) return;
    for (double& odds : odds_) odds = understory::existence::survived(odds, history_.gone_share);
  }
  void look(const LookEvent& event) override {
    if (!event.is_clear) return;
    const double eps = history_.false_rate;
    const double q = eps + (1.0 - eps) * event.recall;
    there_[event.point] *= event.is_seen ? q / eps : (1.0 - q) / (1.0 - eps);
  }
  void end_drive() override {
    for (std::size_t i = 0; i < odds_.size(); ++i) {
      const double ratio = history_.pass_recall * there_[i] + 1.0 - history_.pass_recall;
      odds_[i] = std::min(kSure, odds_[i] * ratio);
      there_[i] = 1.0;
    }
  }
  double probability(std::size_t point) const override {
    return understory::existence::probability_of(odds_[point]);
  }

 private:
  static constexpr double kSure = 1e9;
  const History& history_;
  std::vector<double> odds_;
  std::vector<double> there_;  ///< Likelihood ratio of the drive's looks, if the drive can see it.
  std::size_t drives_ = 0;
};

}  // namespace

std::unique_ptr<Method> make_no_removal(const History&, const std::vector<double>&) {
  return std::make_unique<NoRemoval>();
}
std::unique_ptr<Method> make_ideal(const History& history, const std::vector<double>&) {
  return std::make_unique<Ideal>(history);
}
std::unique_ptr<Method> make_true_rates(const History& history, const std::vector<double>&) {
  return std::make_unique<TrueRates>(history);
}

}  // namespace understory::eval::experiments::existence
