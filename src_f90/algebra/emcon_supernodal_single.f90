! build: streams
!> Cholesky factors by dense blocks in single precision.
!>
!> For corrections that are repeated until a residual vanishes: their last digits are of no use, and
!> what is half as long is read twice as fast.
module emcon_supernodal_single
   use, intrinsic :: iso_fortran_env, only : kp => real32
   use, intrinsic :: ieee_arithmetic, only : ieee_get_underflow_mode, ieee_set_underflow_mode, &
      ieee_support_underflow_control
   use emcon_blas, only : blas_enter_alone, blas_leave_alone, ieee_status_type
   use emcon_blocks_lapack, only : dgemm, dtrmm, potrf => spotrf, syrk => ssyrk, &
      trsm => strsm, trtri => strtri
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, int64
   use emcon_row_panels, only : row_panel_t
   use emcon_supernodes, only : n_lane, n_side, packed_size, supernodes_t
   implicit none
   private
   include "emcon_supernodal_use.inc"

contains

   include "emcon_supernodal_factor.inc"
   include "emcon_supernodal_solve.inc"
   include "emcon_supernodal_rows.inc"

end module emcon_supernodal_single
