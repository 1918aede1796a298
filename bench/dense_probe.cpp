#include <xmmintrin.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include "precompute/inverse/dense_transfer.h"
#include "transfer/file/transfer_data.h"
#include "transfer/file/transfer_file.h"
using namespace rebounce;
int main(int, char** argv) {
  const TransferData d = load_transfer_file(argv[1]);
  std::printf("%zu patches, %zu entries\n", d.patches.size(), d.exchange.exchange_area.size());
  auto t0 = std::chrono::steady_clock::now();
  double last = 0;
  if (std::getenv("FTZ")) {
#pragma omp parallel
    _mm_setcsr(_mm_getcsr() | 0x8040);
  }

  (void)build_dense_transfer(
      d.exchange, d.patches, Precision::kF32,
      [&](double done) {
        const double t =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
        if (t - last > 5) {
          std::printf("%.1f s %.3f\n", t, done);
          std::fflush(stdout);
          last = t;
        }
        return true;
      },
      Arithmetic::kSingle);
  std::printf("total %.1f s\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count());
}
