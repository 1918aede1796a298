#include "precompute/cli/mpi_ranks.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <new>
#include <thread>

#ifdef REBOUNCE_WITH_MPI
#include <mpi.h>
#endif

#include "precompute/cli/out_of_memory.h"

namespace rebounce::cli {
namespace {

#ifdef REBOUNCE_WITH_MPI

// MPI counts in int.
constexpr std::size_t kMostBytes = std::size_t{1} << 28;

/// Open MPI, MPICH and its kin, and launchers with PMIx say so in the environment.
bool is_begun_by_mpirun() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"}) {
    if (std::getenv(name) != nullptr) return true;
  }
  return false;
}

/// MPI_COMM_WORLD. An error of MPI ends all ranks, which is its default.
class World final : public MpiRanks {
 public:
  World() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
  }
  ~World() override { MPI_Finalize(); }

  std::size_t rank() const override { return static_cast<std::size_t>(rank_); }
  std::size_t count() const override { return static_cast<std::size_t>(count_); }

  void broadcast(std::span<std::byte> bytes, std::size_t root) override {
    while (!bytes.empty()) {
      const auto some = bytes.first(std::min(bytes.size(), kMostBytes));
      MPI_Bcast(some.data(), static_cast<int>(some.size()), MPI_BYTE, static_cast<int>(root),
                MPI_COMM_WORLD);
      bytes = bytes.subspan(some.size());
    }
  }

  void abort(int status) override { MPI_Abort(MPI_COMM_WORLD, status); }

 private:
  int rank_ = 0, count_ = 1;
};

#endif

}  // namespace

std::unique_ptr<MpiRanks> join_ranks() {
#ifdef REBOUNCE_WITH_MPI
  if (is_begun_by_mpirun()) return std::make_unique<World>();
#endif
  return nullptr;
}

void end_all(MpiRanks& ranks, const std::exception& error) {
  const bool has_no_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  const char* what = has_no_memory ? kOutOfMemory : error.what();
  if (ranks.rank() == 0) {
    std::fprintf(stderr, "rebounce: %s\n", what);
  } else {
    std::this_thread::sleep_for(std::chrono::seconds(2));  // rank 0 ends this one if it fails too
    std::fprintf(stderr, "rebounce: rank %zu: %s\n", ranks.rank(), what);
  }
  std::fflush(stderr);
  ranks.abort(1);
  std::_Exit(1);
}

}  // namespace rebounce::cli
