// A service small enough to reason about: counts odometry, gives the sum as RAW_POSE.
#pragma once

#include <string>

#include "common/bus/service.hpp"
#include "understory/raw_pose_t.hpp"

namespace understory::test {

class ToyAdapter : public bus::Adapter {
 public:
  void describe(bus::ParameterTable& table) override {
    table.add("toy.gain", gain_, {0.1, 10.0}, "", "Multiplies every step.");
    table.add("toy.every", every_, {1, 100}, "messages", "One output for so many inputs.");
    table.add("toy.negate", negate_, "Turns the sign.");
    table.add("toy.mode", mode_, {"plain", "throwing"}, "Throwing: fails at every tenth input.");
  }
  void bind(bus::Node& node) override {
    node.subscribe<model::Odometry>("ODOMETRY",
                                    [this](const model::Odometry& motion) { add(motion); });
    poses_ = node.advertise<raw_pose_t>("RAW_POSE");
    node.every(1000000, [this](model::Utime) { ++ticks_; });
  }
  std::string save() const override {
    return std::to_string(count_) + " " + std::to_string(sum_) + " " + std::to_string(ticks_);
  }
  void load(const std::string& state) override {
    if (std::sscanf(state.c_str(), "%d %lf %d", &count_, &sum_, &ticks_) != 3) {
      throw std::runtime_error("no state of the toy");
    }
  }

 private:
  void add(const model::Odometry& motion) {
    ++count_;
    if (mode_ == "throwing" && count_ % 10 == 0) throw std::runtime_error("the tenth");
    sum_ += (negate_ ? -1.0 : 1.0) * gain_ * motion.from_T_to.x();
    if (count_ % every_ != 0) return;
    raw_pose_t pose{};
    pose.utime = motion.utime;
    pose.odom_T_vehicle.x = sum_;
    pose.odom_T_vehicle.y = ticks_;
    poses_.publish(pose);
  }

  double gain_ = 1.0;
  int every_ = 1;
  bool negate_ = false;
  std::string mode_ = "plain";
  int count_ = 0;
  int ticks_ = 0;
  double sum_ = 0.0;
  bus::Publisher<raw_pose_t> poses_;
};

inline bus::Service toy_service() {
  bus::ChannelList channels;
  channels.in("ODOMETRY", "steps");
  channels.out("RAW_POSE", "the sum of the steps");
  return {"toy", channels, [] { return std::make_unique<ToyAdapter>(); }};
}

/// The i-th input: 100 ms apart, x = i + 1 (whole numbers: sums are exact).
inline model::Odometry toy_input(int i) {
  model::Odometry motion;
  motion.from_utime = 1000000 + 100000 * static_cast<model::Utime>(i);
  motion.utime = motion.from_utime + 100000;
  motion.sequence = static_cast<std::uint64_t>(i);
  motion.from_T_to = geometry::SE2(i + 1.0, 0.0, 0.0);
  return motion;
}

}  // namespace understory::test
