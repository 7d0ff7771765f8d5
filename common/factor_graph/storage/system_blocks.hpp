// Blocks of memory from the system, freed with their owner.
#pragma once

#include <cstddef>
#include <new>
#include <utility>

namespace understory::factor_graph::storage {

/// Blocks of any size, each of exactly the requested size. They form a linked list: two pointers
/// per block and no search.
class SystemBlocks {
 public:
  SystemBlocks() = default;
  SystemBlocks(SystemBlocks&& other) noexcept { *this = std::move(other); }
  SystemBlocks& operator=(SystemBlocks&& other) noexcept {
    std::swap(first_, other.first_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~SystemBlocks() {
    while (first_ != nullptr) ::operator delete(std::exchange(first_, first_->next));
  }

  /// A block of `bytes`, not initialised, aligned for any number.
  void* take(std::size_t bytes) {
    auto* link = static_cast<Link*>(::operator new(sizeof(Link) + bytes));
    *link = {nullptr, first_};
    if (first_ != nullptr) first_->previous = link;
    first_ = link;
    bytes_ += sizeof(Link) + bytes;
    return link + 1;
  }
  /// Takes back a block of take(bytes).
  void give_back(void* block, std::size_t bytes) {
    Link* link = static_cast<Link*>(block) - 1;
    (link->previous != nullptr ? link->previous->next : first_) = link->next;
    if (link->next != nullptr) link->next->previous = link->previous;
    bytes_ -= sizeof(Link) + bytes;
    ::operator delete(link);
  }

  /// Memory of the blocks in use [bytes].
  std::size_t bytes() const { return bytes_; }

 private:
  struct alignas(std::max_align_t) Link {
    Link* previous;
    Link* next;
  };

  Link* first_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace understory::factor_graph::storage
