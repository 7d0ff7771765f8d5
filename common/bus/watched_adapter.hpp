// What the adapters of a stage that a HealthWatch judges have in common.
#pragma once

#include <optional>
#include <string>

#include "common/bus/condition.hpp"
#include "common/bus/service.hpp"
#include "common/state/archive.hpp"

namespace understory::bus {

/// Lists parameters whose type has a describe() beside it.
template <class Parameters>
void describe_each(Parameters& parameters, ParameterTable& table) {
  describe(parameters, table);
}

/// An adapter of one stage: lists the parameters of stage and watch, keeps the state of both, and
/// shows in HEALTH what the watch says. `Stage` has save() and load(); `Watch` is made from
/// `Limits`, has conditions() and lists its members for a saved state.
template <class Stage, class Parameters, class Watch, class Limits>
class WatchedAdapter : public Adapter {
 public:
  /// `format`: of the saved state.
  explicit WatchedAdapter(const state::Format& format) : format_(format) {}

  void describe(ParameterTable& table) override {
    describe_each(parameters_, table);
    describe_each(limits_, table);
  }

  std::string save() const override { return state::save(format_, watch_, stage_->save()); }

  void load(const std::string& state) override {
    Watch watch(limits_);
    std::string stage;
    state::load(state, format_, watch, stage);
    stage_->load(stage);
    watch_ = watch;
    show_health();
  }

 protected:
  /// To be called first in bind(): makes the stage from its arguments.
  template <class... Arguments>
  void begin(Node& node, const Arguments&... arguments) {
    node_ = &node;
    stage_.emplace(arguments...);
    watch_ = Watch(limits_);
  }

  /// After each change of the watch.
  void show_health() {
    for (const WatchedCondition& one : watch_.conditions()) node_->show(one);
  }

  Parameters parameters_;
  std::optional<Stage> stage_;
  Watch watch_;
  Node* node_ = nullptr;

 private:
  state::Format format_;
  Limits limits_;
};

}  // namespace understory::bus
