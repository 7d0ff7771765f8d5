#include "common/factor_graph/bayes_tree/clique_tree.hpp"

#include <algorithm>

#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {

double flops_of(const CliqueRecord& clique) {
  return elimination_flops(clique.pivots, clique.size - clique.pivots);
}

CliqueTree::CliqueTree(std::size_t undo_bytes) : undo_bytes_(undo_bytes) {
  cliques_.add();
  commit(true);
}

int CliqueTree::add(int frontal_count, int row_count) {
  const int id = cliques_.add();
  CliqueRecord& clique = cliques_.edit(id);
  clique.frontal_count = frontal_count;
  clique.row_count = row_count;
  clique.rows = names_.take(static_cast<std::size_t>(row_count));
  clique.size = 1;
  return id;
}

void CliqueTree::link(int parent, int child) {
  const int sibling = cliques_[parent].first_child;
  CliqueRecord& record = cliques_.edit(child);
  record.parent = parent;
  record.next_sibling = sibling;
  record.previous_sibling = graph::kNone;

  if (sibling != graph::kNone) cliques_.edit(sibling).previous_sibling = child;
  cliques_.edit(parent).first_child = child;
}

void CliqueTree::unlink_from_root(int child) {
  const CliqueRecord record = cliques_[child];
  if (record.previous_sibling == graph::kNone) {
    cliques_.edit(kRoot).first_child = record.next_sibling;
  } else {
    cliques_.edit(record.previous_sibling).next_sibling = record.next_sibling;
  }
  if (record.next_sibling != graph::kNone) {
    cliques_.edit(record.next_sibling).previous_sibling = record.previous_sibling;
  }
}

void CliqueTree::set_factors(int id, std::span<const int> factors) {
  CliqueRecord& clique = cliques_.edit(id);
  clique.factor_count = static_cast<int>(factors.size());
  clique.factors = names_.take(factors.size());
  std::ranges::copy(factors, clique.factors);
  for (int at = 0; at < clique.factor_count; ++at) places_.put(clique.factors[at], {id, at});
}

void CliqueTree::remove_factor(int factor) {
  const FactorPlace place = places_[factor];
  taken_out_.push_back({factor, place});
  cliques_[place.clique].factors[place.at] = graph::kNone;
  places_.put(factor, {});
}

/// Puts back the factors removed since the last commit. The cliques are already restored.
void CliqueTree::put_factors_back() {
  places_.rollback();
  for (const TakenOut& one : taken_out_) {
    if (places_[one.factor] == one.from)
      cliques_[one.from.clique].factors[one.from.at] = one.factor;
  }
  taken_out_.clear();
}

void CliqueTree::count_work(int id) { total_flops_ += flops_of(cliques_[id]); }

void CliqueTree::remove(std::span<const int> ids) {
  double flops = 0.0;
  for (const int c : ids) {
    flops += flops_of(cliques_[c]);
    if (cliques_[c].parent == kRoot) unlink_from_root(c);
    count_undetermined(cliques_[c].left_out > 0 ? -1 : 0);
    CliqueRecord& clique = cliques_.edit(c);
    clique.parent = graph::kNone;
    drop_panel(clique);
    contributions_.drop(c);
    cliques_.remove(c);
  }
  total_flops_ -= flops;
}

/// False: the numbers of the last commit must be dropped. Called once for each clique.
bool CliqueTree::keeps_for_undo(const CliqueRecord& clique) {
  if (keeps_all_) return true;
  const std::size_t bytes = clique.panel_numbers() * sizeof(double);
  if (bytes > undo_bytes_left_) return false;
  undo_bytes_left_ -= bytes;
  return true;
}

double* CliqueTree::writable_panel(int id) {
  CliqueRecord& clique = cliques_.edit(id);
  if (clique.panel == nullptr) {
    clique.panel = panels_.take(clique.panel_numbers());
  } else if (clique.panel_epoch != cliques_.epoch()) {
    if (keeps_for_undo(clique)) {
      clique.panel = panels_.take(clique.panel_numbers());
    } else {
      clique.lost_epoch = cliques_.epoch();
    }
  }
  clique.panel_epoch = cliques_.epoch();
  return clique.panel;
}

/// Drops the panel of a removed clique; numbers from before the last commit stay if they fit.
void CliqueTree::drop_panel(CliqueRecord& clique) {
  if (clique.panel == nullptr) return;
  if (clique.panel_epoch != cliques_.epoch()) {
    if (keeps_for_undo(clique)) return;
    clique.lost_epoch = cliques_.epoch();
  }
  panels_.give_back(clique.panel, clique.panel_numbers());
  clique.panel = nullptr;
}

void CliqueTree::set_left_out(int id, int count) {
  CliqueRecord& clique = cliques_.edit(id);
  const int before = clique.left_out;
  clique.left_out = count;
  count_undetermined((count > 0 ? 1 : 0) - (before > 0 ? 1 : 0));
}

/// The root's `left_out` is journaled with it.
void CliqueTree::count_undetermined(int change) {
  if (change != 0) cliques_.edit(kRoot).left_out += change;
}

void CliqueTree::free_blocks(const CliqueRecord& clique) {
  if (clique.rows != nullptr) {
    names_.give_back(clique.rows, static_cast<std::size_t>(clique.row_count));
  }
  if (clique.factors != nullptr) {
    names_.give_back(clique.factors, static_cast<std::size_t>(clique.factor_count));
  }
  if (clique.panel != nullptr) panels_.give_back(clique.panel, clique.panel_numbers());
}

void CliqueTree::commit(bool is_up_to_date) {
  const std::uint64_t epoch = cliques_.epoch();
  cliques_.commit([&](const CliqueRecord& gone) { free_blocks(gone); },
                  [&](const CliqueRecord& before, const CliqueRecord& now) {
                    const bool is_kept = before.panel != nullptr && now.lost_epoch != epoch;
                    if (is_kept && before.panel != now.panel) {
                      panels_.give_back(before.panel, before.panel_numbers());
                    }
                  });
  places_.commit();
  taken_out_.clear();
  saved_total_flops_ = total_flops_;
  undo_bytes_left_ = undo_bytes_;
  keeps_all_ = !is_up_to_date;
  lost_.clear();
}

void CliqueTree::rollback() {
  const std::uint64_t epoch = cliques_.epoch();
  lost_.clear();
  cliques_.rollback(
      [&](int id, const CliqueRecord& now, const CliqueRecord& before) {
        if (now.panel_epoch == epoch) contributions_.drop(id);
        if (now.lost_epoch == epoch) lost_.push_back(id);
        const bool is_other = now.panel != before.panel || now.lost_epoch == epoch;
        if (is_other && now.panel != nullptr) panels_.give_back(now.panel, now.panel_numbers());
      },
      [&](int id, const CliqueRecord& gone) {
        contributions_.drop(id);
        free_blocks(gone);
      });
  put_factors_back();

  for (const int id : lost_) {
    CliqueRecord& clique = cliques_.edit_unsaved(id);
    clique.panel = panels_.take(clique.panel_numbers());
  }
  total_flops_ = saved_total_flops_;
  undo_bytes_left_ = undo_bytes_;
}

}  // namespace understory::factor_graph::bayes_tree
