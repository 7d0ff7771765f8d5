#include "eval/experiments/existence/own_methods.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "common/existence/baseline.hpp"
#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/neighbours.hpp"
#include "common/existence/point.hpp"
#include "common/existence/von_mises_fisher_shell.hpp"

namespace understory::eval::experiments::existence {
namespace {

namespace model = understory::existence;

constexpr double kOwnMonth_s = 30.0 * 86400.0;
constexpr float kPatch_m = 12.0F;

model::Parameters parameters_of(const std::vector<double>& tuned) {
  model::Parameters parameters;
  parameters.decay_per_s = tuned.at(0) / kOwnMonth_s;
  parameters.decay_weight = tuned.at(1);
  parameters.pass_recall = tuned.at(2);
  parameters.pass_recall_weight = tuned.at(3);
  return parameters;
}

/// A point is born at its first sighting; misses before it are no evidence of a point of the map.
template <typename S>
class OwnMethod : public Method {
 public:
  OwnMethod(const History& history, const model::Parameters& parameters)
      : model_(parameters),
        points_(history.points_m.size(), model::PointExistence<S>::known(model_)),
        is_born_(history.points_m.size(), false) {}

  void begin_drive(double time_s) override {
    const model::Elapsed time = model_.elapsed(time_s - time_s_);
    if (drives_++ > 0) model_.begin_drive();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!is_born_[i]) continue;
      points_[i].elapse(model_, time);
      points_[i].enter_pass(model_);
    }
    learn();
    time_s_ = time_s;
  }
  void look(const LookEvent& event) override {
    auto& point = points_[event.point];
    if (is_born_[event.point]) {
      event.is_seen ? point.hit(model_, event.look) : point.miss(model_, event.look);
    } else if (event.is_seen) {
      point = model::PointExistence<S>::born(model_, event.look);
      is_born_[event.point] = true;
    }
  }
  void end_drive() override { learn(); }
  double probability(std::size_t point) const override { return points_[point].probability(); }

 protected:
  /// What all points have taught of passes and of the world is applied to each.
  void learn() {
    model::PassHistories histories;
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (is_born_[i]) points_[i].tell(histories);
    model_.learn(histories);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (is_born_[i]) points_[i].reconsider(model_);
  }
  std::vector<model::PointExistence<S>>& points() { return points_; }

 private:
  model::ExistenceModel model_;
  std::vector<model::PointExistence<S>> points_;
  std::vector<bool> is_born_;
  double time_s_ = 0.0;
  int drives_ = 0;
};

/// Points of a square of the ground are a patch.
class PatchedMethod : public OwnMethod<model::IcosahedralShell> {
 public:
  PatchedMethod(const History& history, const model::Parameters& parameters)
      : OwnMethod(history, parameters), positions_m_(history.points_m) {}

  void begin_drive(double time_s) override {
    OwnMethod::begin_drive(time_s);
    patches_.clear();
    members_.clear();
    for (std::size_t i = 0; i < points().size(); ++i)
      members_.push_back(patch_of(i).join(model::odds_of(probability(i))));
  }
  void end_drive() override {
    learn();
    for (std::size_t i = 0; i < points().size(); ++i)
      patch_of(i).update(members_[i], model::odds_of(probability(i)), points()[i].missed_from());
    std::vector<double> joint;
    for (std::size_t i = 0; i < points().size(); ++i)
      joint.push_back(patch_of(i).probability(members_[i]));
    for (std::size_t i = 0; i < points().size(); ++i)
      points()[i].multiply_odds(model::odds_of(joint[i]) / model::odds_of(probability(i)));
  }

 private:
  model::Patch& patch_of(std::size_t point) {
    const Eigen::Vector3f& at = positions_m_[point];
    return patches_[{static_cast<int>(std::floor(at.x() / kPatch_m)),
                     static_cast<int>(std::floor(at.y() / kPatch_m))}];
  }
  std::vector<Eigen::Vector3f> positions_m_;
  std::map<std::pair<int, int>, model::Patch> patches_;
  std::vector<model::PatchMember> members_;
};

class ThesisMethod : public Method {
 public:
  ThesisMethod(const History& history, const std::vector<double>& tuned)
      : points_(history.points_m.size(),
                model::BaselinePoint({.recall = tuned[0], .face_threshold = tuned[1]})) {}
  void begin_drive(double) override {}
  void look(const LookEvent& event) override {
    if (event.is_seen)
      points_[event.point].hit(event.look.from_point_m);
    else
      points_[event.point].miss(event.look.from_point_m);
  }
  double probability(std::size_t point) const override { return points_[point].probability(); }

 private:
  std::vector<model::BaselinePoint> points_;
};

using Icosahedral = OwnMethod<model::IcosahedralShell>;

}  // namespace

std::unique_ptr<Method> make_icosahedral(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<Icosahedral>(history, parameters_of(tuned));
}
std::unique_ptr<Method> make_von_mises_fisher(const History& history,
                                              const std::vector<double>& tuned) {
  return std::make_unique<OwnMethod<model::VonMisesFisherShell<6>>>(history, parameters_of(tuned));
}
std::unique_ptr<Method> make_neighbours(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<PatchedMethod>(history, parameters_of(tuned));
}
std::unique_ptr<Method> make_no_decay(const History& history, const std::vector<double>& tuned) {
  model::Parameters parameters = parameters_of(tuned);
  parameters.decay_per_s = 0.0;
  parameters.decay_weight = 0.0;
  parameters.relax_per_s = 0.0;
  return std::make_unique<Icosahedral>(history, parameters);
}
std::unique_ptr<Method> make_no_redundancy(const History& history,
                                           const std::vector<double>& tuned) {
  model::Parameters parameters = parameters_of(tuned);
  parameters.learn_visibility = false;
  parameters.pass_recall = 1.0;
  return std::make_unique<Icosahedral>(history, parameters);
}
std::unique_ptr<Method> make_one_level(const History& history, const std::vector<double>& tuned) {
  model::Parameters parameters = parameters_of(tuned);
  parameters.pass_recall = 1.0;
  return std::make_unique<Icosahedral>(history, parameters);
}
std::unique_ptr<Method> make_told_recall(const History& history, const std::vector<double>& tuned) {
  model::Parameters parameters = parameters_of(tuned);
  parameters.learn_recall = false;
  return std::make_unique<Icosahedral>(history, parameters);
}
std::unique_ptr<Method> make_thesis(const History& history, const std::vector<double>& tuned) {
  return std::make_unique<ThesisMethod>(history, tuned);
}

}  // namespace understory::eval::experiments::existence
