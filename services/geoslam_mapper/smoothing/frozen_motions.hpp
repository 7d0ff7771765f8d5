// Compact store of the motions of nodes outside the solved graph.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "services/geoslam_mapper/smoothing/frozen_part.hpp"
#include "services/geoslam_mapper/smoothing/node_set.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Motions with at least one frozen end. They are needed only when the node thaws, and there are
/// some for each 20 m ever driven: each takes 44 bytes, in single precision (some micrometres, and
/// 1e-7 of the information). Closures, and motions between nodes with distant numbers, are few and
/// kept in full.
class FrozenMotions {
 public:
  /// Adds a motion.
  void add(const FrozenMotion& motion);
  /// Removes and returns the motions with no end among these nodes.
  std::vector<FrozenMotion> take_beyond(const NodeSet& frozen);
  /// All of them. O(motions).
  std::vector<FrozenMotion> all() const;
  /// Whether this closure is among them.
  bool has_closure(std::uint64_t id) const;
  /// Number of motions.
  std::size_t size() const { return packed_.size() + whole_.size(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.packed_, s.whole_);
  }

 private:
  struct Packed {
    NodeIndex a = 0;
    std::int16_t a_to_b = 0;  ///< Difference of the two nodes' numbers.
    std::uint16_t away = 0;
    std::array<float, 3> a_T_b{};  ///< x, y [m], heading [rad].
    /// Lower triangle of the information's Cholesky factor, by rows.
    std::array<float, 6> root{};

    NodeIndex b() const { return a + static_cast<NodeIndex>(std::int32_t{a_to_b}); }
    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.a, s.a_to_b, s.away, s.a_T_b, s.root);
    }
  };
  static bool can_pack(const FrozenMotion& motion);
  static Packed packed(const FrozenMotion& motion);
  static FrozenMotion unpacked(const Packed& packed);

  std::deque<Packed> packed_;  ///< Grows by blocks, without unused capacity.
  std::vector<FrozenMotion> whole_;
};

}  // namespace understory::geoslam_mapper::smoothing
