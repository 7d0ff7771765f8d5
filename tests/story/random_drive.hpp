// A mapper that does at random what mappers do, and what there is to say about each landmark.
#pragma once

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"

namespace understory::test {

constexpr model::LandmarkId id_of(std::uint32_t map, std::uint64_t counter) {
  return (model::LandmarkId{map} << model::kLandmarkCounterBits) | counter;
}

/// A message with this stamp and nothing else.
template <class Message>
Message stamped(model::Utime utime) {
  Message message;
  message.utime = utime;
  return message;
}

/// All that the mapper and the existence tracker said of one keyframe.
struct Said {
  model::MapUpdate update;
  model::MapDelta delta;
  model::Existence existence;
};

/// Landmarks come, are seen and missed, merge and go. One keyframe a second, some without a place.
class RandomDrive {
 public:
  explicit RandomDrive(std::uint64_t seed) : random_(seed) {}

  Said next() {
    Said said;
    model::MapUpdate& update = said.update;
    update.keyframe_sequence = sequence_;
    update.utime = said.delta.utime = said.existence.utime = 1'000'000 * (1 + sequence_);
    update.map_T_vehicle = {0.5 * static_cast<double>(sequence_), 1.0, 0.1};
    update.status = sequence_ == 0 ? model::MapUpdateStatus::kFirstMap
                    : chance(0.9)  ? model::MapUpdateStatus::kUpdated
                                   : model::MapUpdateStatus::kNotSure;
    ++sequence_;
    if (update.status == model::MapUpdateStatus::kNotSure) return said;

    look(said);
    add(said);
    if (chance(0.2)) merge(said);
    if (chance(0.2)) remove(said);
    judge(said);
    return said;
  }
  std::uint64_t given() const { return counter_; }

 private:
  bool chance(double share) { return std::bernoulli_distribution(share)(random_); }
  Eigen::Vector2d place() {
    std::uniform_real_distribution<double> metres(-100.0, 100.0);
    return {metres(random_), metres(random_)};
  }
  model::LandmarkId pick() {
    std::uniform_int_distribution<std::size_t> which(0, there_.size() - 1);
    return *std::next(there_.begin(), static_cast<long>(which(random_)));
  }

  void look(Said& said) {
    for (const model::LandmarkId id : there_) {
      const auto index = static_cast<std::uint32_t>(said.update.associations.size());
      if (chance(0.3)) {
        said.update.associations.push_back({index, id});
        if (chance(0.05)) said.update.associations.push_back({index + 1, id});
      } else if (chance(0.3)) {
        said.update.expected.push_back({id});
      }
      if (chance(0.1)) said.delta.moved.push_back(landmark(id));
    }
  }
  void add(Said& said) {
    for (int i = 0; i < 2; ++i) {
      if (sequence_ > 1 && !chance(0.4)) continue;
      const model::LandmarkId id = id_of(1, ++counter_);
      there_.insert(id);
      said.update.added.push_back(id);
      said.update.associations.push_back(
          {static_cast<std::uint32_t>(said.update.associations.size()), id});
      said.delta.added.push_back(landmark(id));
    }
  }
  void merge(Said& said) {
    if (there_.size() < 4) return;
    const model::LandmarkId old_id = pick();
    there_.erase(old_id);
    said.update.merged.emplace_back(old_id, pick());
    said.delta.merged = said.update.merged;
    forget(said, old_id);
  }
  void remove(Said& said) {
    if (there_.size() < 4) return;
    const model::LandmarkId id = pick();
    there_.erase(id);
    said.update.removed.push_back(id);
    said.delta.removed.push_back(id);
    forget(said, id);
  }
  /// What is gone is not told any more.
  static void forget(Said& said, model::LandmarkId id) {
    const auto is_it = [&](const model::MapLandmark& one) { return one.id == id; };
    std::erase_if(said.delta.moved, is_it);
    std::erase_if(said.delta.added, is_it);
  }
  void judge(Said& said) {
    std::uniform_real_distribution<double> probability(0.0, 1.0);
    for (const model::LandmarkId id : there_) {
      if (chance(0.5)) said.existence.landmarks.push_back({id, probability(random_), chance(0.8)});
    }
  }
  model::MapLandmark landmark(model::LandmarkId id) {
    model::MapLandmark one;
    one.id = id;
    one.position_m = place();
    one.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
    return one;
  }

  std::mt19937_64 random_;
  std::uint64_t sequence_ = 0;
  std::uint64_t counter_ = 0;
  std::set<model::LandmarkId> there_;
};

/// What a reader of all messages would note of one landmark.
struct Noted {
  std::vector<std::uint64_t> seen;    ///< Keyframes.
  std::vector<std::uint64_t> missed;  ///< Likewise.
  std::vector<std::uint64_t> born;
  std::vector<std::pair<model::Utime, double>> probabilities;
  std::vector<std::pair<std::uint64_t, model::LandmarkId>> merged;   ///< Keyframe, survivor.
  std::vector<std::pair<std::uint64_t, model::LandmarkId>> took_up;  ///< Keyframe, old one.
  std::vector<std::uint64_t> removed;
  std::vector<Eigen::Vector2d> told;
  std::vector<bool> in_use;
};

/// Reads everything, keeps everything.
class NaiveReader {
 public:
  void take(const model::MapUpdate& update) {
    const bool is_placed = update.status == model::MapUpdateStatus::kFirstMap ||
                           update.status == model::MapUpdateStatus::kUpdated;
    if (!is_placed) return;
    const std::uint64_t keyframe = update.keyframe_sequence;
    std::set<model::LandmarkId> seen;
    for (const auto& pair : update.associations) seen.insert(pair.landmark_id);
    for (const auto id : seen) notes_[id].seen.push_back(keyframe);
    for (const auto& one : update.expected) notes_[one.id].missed.push_back(keyframe);
    for (const auto id : update.added) notes_[id].born.push_back(keyframe);
    for (const auto id : update.removed) notes_[id].removed.push_back(keyframe);
    for (const auto& [old_id, new_id] : update.merged) {
      notes_[old_id].merged.emplace_back(keyframe, new_id);
      notes_[new_id].took_up.emplace_back(keyframe, old_id);
    }
    placed_.push_back(keyframe);
  }
  void take(const model::MapDelta& delta) {
    for (const auto& one : delta.added) notes_[one.id].told.push_back(one.position_m);
    for (const auto& one : delta.moved) notes_[one.id].told.push_back(one.position_m);
  }
  void take(const model::Existence& existence) {
    for (const auto& one : existence.landmarks) {
      notes_[one.id].probabilities.emplace_back(existence.utime, one.probability);
      notes_[one.id].in_use.push_back(one.is_in_use);
    }
  }
  const std::map<model::LandmarkId, Noted>& notes() const { return notes_; }

  /// Stretches of placed keyframes between two that saw it.
  std::pair<std::size_t, std::size_t> gaps_and_longest(const Noted& noted) const {
    std::size_t gaps = 0;
    std::size_t longest = 0;
    for (std::size_t i = 1; i < noted.seen.size(); ++i) {
      const auto between = std::count_if(placed_.begin(), placed_.end(), [&](std::uint64_t k) {
        return k > noted.seen[i - 1] && k < noted.seen[i];
      });
      if (between > 0) ++gaps;
      longest = std::max(longest, static_cast<std::size_t>(between));
    }
    return {gaps, longest};
  }

 private:
  std::map<model::LandmarkId, Noted> notes_;
  std::vector<std::uint64_t> placed_;
};

}  // namespace understory::test
