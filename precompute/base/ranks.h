#pragma once

// How the processes of one build share its loops. MPI calls a process a rank.
//
// All ranks run the same build on the same scene. In the loops that take most of the time each rank
// makes its share of the items; then every rank gets the items of all. So all ranks go the same
// way, and the results have the bits of one rank.

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace rebounce {

/// What joins the ranks of a build.
class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual std::size_t rank() const = 0;  ///< of this process, below count()
  virtual std::size_t count() const = 0;
  /// Copies the bytes that rank `root` has to the same place of all ranks. All of them call it.
  virtual void broadcast(std::span<std::byte> bytes, std::size_t root) = 0;
};

/// Makes `communicator` that of the calling thread for the lifetime of the object. With a null
/// pointer, and without a scope, the thread is a rank alone.
class CommunicatorScope {
 public:
  /// `communicator` must outlive the object.
  explicit CommunicatorScope(Communicator* communicator);
  ~CommunicatorScope();
  CommunicatorScope(const CommunicatorScope&) = delete;
  CommunicatorScope& operator=(const CommunicatorScope&) = delete;

 private:
  Communicator* before_;
};

/// The ranks of the calling thread's build. Loops of OpenMP take it along from the thread that
/// begins them.
class Ranks {
 public:
  Ranks();

  std::size_t rank() const { return communicator_ == nullptr ? 0 : communicator_->rank(); }
  std::size_t count() const { return communicator_ == nullptr ? 1 : communicator_->count(); }
  bool alone() const { return count() == 1; }

  /// Whether this rank makes item k of a loop whose items go to ranks in turns, `run` at a time.
  bool makes(std::size_t k, std::size_t run = 1) const { return k / run % count() == rank(); }

  /// Gives all ranks the items that each has made, with the same `run` as in makes(). Their number
  /// is the same on all ranks.
  template <typename T>
  void share(std::span<T> items, std::size_t run = 1) const {
    static_assert(std::is_trivially_copyable_v<T>);
    if (alone()) return;
    for (std::size_t root = 0; root < count(); ++root) {
      std::vector<T> made;
      for_each_of(root, items.size(), run, [&](std::size_t k) { made.push_back(items[k]); });
      broadcast(std::as_writable_bytes(std::span(made)), root);
      auto next = made.begin();
      for_each_of(root, items.size(), run, [&](std::size_t k) { items[k] = *next++; });
    }
  }

  /// The same with items of any length.
  template <typename T>
  void share(std::span<std::vector<T>> items, std::size_t run = 1) const {
    if (alone()) return;
    std::vector<std::size_t> sizes;
    for (const std::vector<T>& item : items) sizes.push_back(item.size());
    share(std::span(sizes), run);
    for (std::size_t root = 0; root < count(); ++root) {
      std::vector<T> made;
      for_each_of(root, items.size(), run, [&](std::size_t k) {
        if (root == rank()) made.insert(made.end(), items[k].begin(), items[k].end());
        if (root != rank()) made.resize(made.size() + sizes[k]);
      });
      broadcast(std::as_writable_bytes(std::span(made)), root);
      if (root == rank()) continue;
      auto next = made.begin();
      for_each_of(root, items.size(), run, [&](std::size_t k) {
        items[k].assign(next, next + static_cast<std::ptrdiff_t>(sizes[k]));
        next += static_cast<std::ptrdiff_t>(sizes[k]);
      });
    }
  }

  /// The least of the values that the ranks have.
  std::size_t least(std::size_t value) const {
    std::vector<std::size_t> of_rank(count(), value);
    share(std::span(of_rank));
    return std::ranges::min(of_rank);
  }

  /// The sums of `values` over all ranks, in their order; the same bits on all.
  template <typename T>
  void add_up(std::span<T> values) const {
    if (alone()) return;
    const std::vector<T> mine(values.begin(), values.end());
    std::ranges::fill(values, T{});
    for (std::size_t root = 0; root < count(); ++root) {
      std::vector<T> other = mine;
      broadcast(std::as_writable_bytes(std::span(other)), root);
      for (std::size_t k = 0; k < values.size(); ++k) values[k] += other[k];
    }
  }

 private:
  /// Gives all ranks the bytes of rank `root`.
  void broadcast(std::span<std::byte> bytes, std::size_t root) const;

  template <typename Visit>
  void for_each_of(std::size_t root, std::size_t item_count, std::size_t run,
                   const Visit& visit) const {
    for (std::size_t first = root * run; first < item_count; first += count() * run) {
      for (std::size_t k = first; k < std::min(item_count, first + run); ++k) visit(k);
    }
  }

  Communicator* communicator_;
};

}  // namespace rebounce
