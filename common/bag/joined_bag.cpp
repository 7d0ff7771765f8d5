#include "common/bag/joined_bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace understory::bag {

JoinedBag::JoinedBag(std::vector<std::unique_ptr<Bag>> parts, const std::string& folder)
    : parts_(std::move(parts)),
      topic_of_(parts_.size()),
      heads_(parts_.size()),
      is_wanted_(parts_.size(), true),
      remark_(fmt::format("{}: {} files, joined in order of time", folder, parts_.size())) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for (const Topic& topic : parts_[p]->topics()) {
      const auto same =
          std::ranges::find_if(topics_, [&](const Topic& other) { return other.is_same(topic); });
      topic_of_[p].push_back(static_cast<std::size_t>(same - topics_.begin()));
      if (same == topics_.end()) {
        topics_.push_back(topic);
      } else if (same->messages && topic.messages) {
        *same->messages += *topic.messages;
      }
    }
  }
  rewind({});
}

void JoinedBag::rewind(const std::vector<std::size_t>& wanted) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    std::vector<std::size_t> own;
    for (std::size_t t = 0; t < topic_of_[p].size(); ++t) {
      if (wanted.empty() || std::ranges::find(wanted, topic_of_[p][t]) != wanted.end())
        own.push_back(t);
    }
    is_wanted_[p] = !own.empty();
    if (is_wanted_[p]) parts_[p]->rewind(own);
    heads_[p] = is_wanted_[p] ? parts_[p]->next() : std::nullopt;
  }
  given_.reset();
}

std::optional<Message> JoinedBag::next() {
  if (given_) heads_[*given_] = parts_[*given_]->next();
  given_.reset();
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (!heads_[p]) continue;
    if (!given_ || heads_[p]->received_ns < heads_[*given_]->received_ns) given_ = p;
  }
  if (!given_) return std::nullopt;

  Message message = *heads_[*given_];
  message.topic = topic_of_[*given_][message.topic];
  return message;
}

std::vector<std::string> JoinedBag::remarks() const {
  std::vector<std::string> all{remark_};
  for (const auto& part : parts_) {
    const auto own = part->remarks();
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

std::string JoinedBag::kind() const { return parts_.front()->kind(); }

}  // namespace understory::bag
