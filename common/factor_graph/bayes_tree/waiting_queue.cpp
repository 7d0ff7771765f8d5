#include "common/factor_graph/bayes_tree/waiting_queue.hpp"

namespace understory::factor_graph::bayes_tree {

void WaitingQueue::add(int clique, int capacity) {
  is_waiting_.resize(static_cast<std::size_t>(capacity), 0);
  if (!waits(clique)) waiting_.push_back(clique);
  is_waiting_[static_cast<std::size_t>(clique)] = 1;
}

void WaitingQueue::drop(int clique) {
  const auto at = static_cast<std::size_t>(clique);
  if (at < is_waiting_.size()) is_waiting_[at] = 0;
}

void WaitingQueue::clear() {
  for (const int c : waiting_) is_waiting_[static_cast<std::size_t>(c)] = 0;
  waiting_.clear();
}

void WaitingQueue::commit() {
  saved_.clear();
  for (const int c : waiting_) {
    if (waits(c)) saved_.push_back(c);
  }
}

void WaitingQueue::rollback(int capacity) {
  clear();
  for (const int c : saved_) add(c, capacity);
}

}  // namespace understory::factor_graph::bayes_tree
