// Several files of one recording as one.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"

namespace understory::bag {

/// Joins files in order of time; topics of equal name, type and encoding are merged.
class JoinedBag : public Bag {
 public:
  /// At least one part; `folder` is their name in remarks.
  JoinedBag(std::vector<std::unique_ptr<Bag>> parts, const std::string& folder);

  const std::vector<Topic>& topics() const override { return topics_; }
  std::optional<Message> next() override;
  void rewind(const std::vector<std::size_t>& wanted) override;
  std::vector<std::string> remarks() const override;
  std::string kind() const override;

 private:
  std::vector<std::unique_ptr<Bag>> parts_;
  std::vector<Topic> topics_;
  std::vector<std::vector<std::size_t>> topic_of_;  ///< Topic by part and the part's topic.
  std::vector<std::optional<Message>> heads_;       ///< The next message of each part.
  std::optional<std::size_t> given_;                ///< The part of the message returned last.
  std::vector<bool> is_wanted_;                     ///< By part: whether it has a selected topic.
  std::string remark_;
};

}  // namespace understory::bag
