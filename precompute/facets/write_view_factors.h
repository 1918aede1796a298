#pragma once

#include <filesystem>
#include <string>

#include "precompute/facets/exchange_factors.h"
#include "precompute/facets/view_factors.h"

namespace rebounce {

// Every file is written whole or not at all; each function throws Error if it cannot be.

/// A NumPy .npz file that scipy.sparse.load_npz reads, with `area`, `sky` and `blocked` [n] beside
/// the matrix, and `exchange_factor` [n, n] and `exchange_sky` [n] if `exchange` is not null.
void write_npz(const std::filesystem::path& path, const ViewFactors& factors,
               const ExchangeFactors* exchange = nullptr);

/// The file of the sky that belongs to a MatrixMarket file: ".sky.mtx" for the extension.
std::filesystem::path sky_file_beside(const std::filesystem::path& path);

/// The factors as a MatrixMarket file, and in sky_file_beside(path) the sky as one column.
void write_matrix_market(const std::filesystem::path& path, const ViewFactors& factors);

/// Files of u-DALES in `folder`, which is made if it is missing: vfsparse.inp.NNN with a line
/// "i j F" for each factor, numbered from 1, and svf.inp.NNN with a comment and one number a facet.
void write_u_dales(const std::filesystem::path& folder, const std::string& case_number,
                   const ViewFactors& factors);

}  // namespace rebounce
