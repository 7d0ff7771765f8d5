// The motions of nodes that are out of the solved graph, in little room.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "services/geoslam_mapper/smoothing/frozen_part.hpp"
#include "services/geoslam_mapper/smoothing/node_set.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Motions of which one end at least is frozen. They are needed only where the node comes back, and
/// there are some for each 20 m that were ever driven: each takes 44 bytes, in single precision
/// (some micrometres, and a ten-millionth of the information). Closures, and motions between nodes
/// whose numbers lie far apart, are few and kept whole.
class FrozenMotions {
 public:
  /// Adds one.
  void add(const FrozenMotion& motion);
  /// Takes out those of which no end is among these nodes.
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
    std::int16_t a_to_b = 0;  ///< From the one's number to the other's.
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

  std::deque<Packed> packed_;  ///< No room that is not used: it grows by blocks.
  std::vector<FrozenMotion> whole_;
};

}  // namespace understory::geoslam_mapper::smoothing
