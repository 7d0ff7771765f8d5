// What a client shows after a sequence of SceneUpdates.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace understory::test {

/// Entities by id.
class ShownScene {
 public:
  void take(const nlohmann::json& update) {
    for (const auto& deletion : update["deletions"]) {
      if (deletion["type"] == 1) {
        std::erase_if(entities_, [&](const auto& one) { return is_older(one.second, deletion); });
      } else {
        const auto found = entities_.find(deletion["id"]);
        if (found != entities_.end() && is_older(found->second, deletion)) entities_.erase(found);
      }
    }
    for (const auto& entity : update["entities"]) entities_[entity["id"]] = entity;
  }
  void take(const std::string& update) { take(nlohmann::json::parse(update)); }

  /// Entities without their stamps.
  std::map<std::string, nlohmann::json> content() const {
    auto result = entities_;
    for (auto& [id, entity] : result) entity.erase("timestamp");
    return result;
  }
  std::size_t landmarks() const {
    std::size_t count = 0;
    for (const auto& [id, one] : entities_) count += one["cylinders"].size() + one["cubes"].size();
    return count;
  }

 private:
  static std::int64_t stamp(const nlohmann::json& one) {
    return one["timestamp"]["sec"].get<std::int64_t>() * 1'000'000'000 +
           one["timestamp"]["nsec"].get<std::int64_t>();
  }
  static bool is_older(const nlohmann::json& entity, const nlohmann::json& deletion) {
    return stamp(entity) < stamp(deletion);
  }

  std::map<std::string, nlohmann::json> entities_;
};

}  // namespace understory::test
