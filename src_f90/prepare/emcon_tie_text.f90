!> Beginnings and parts of messages on ties.
module emcon_tie_text
   use emcon_couplings, only : tie_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_text, only : joined, string_t, to_text
   implicit none
   private
   public :: tie_text, tolerance_text, raise_shared, most_named

   !> Nodes or faces named in a message.
   integer, parameter :: most_named = 10

contains

   !> "deck.inp:12: error: tie NAME: "
   pure function tie_text(scene, tie) result(text)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      character(len=tie_length(scene, tie)) :: text

      text = where_text(scene, tie%origin) // ": error: tie " // tie%name // ": "
   end function tie_text

   pure integer function tie_length(scene, tie) result(length)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie

      length = len(where_text(scene, tie%origin)) + len(": error: tie : ") + len(tie%name)
   end function tie_length

   !> An error if one of the surfaces has no facets, or if they have nodes in common.
   pure subroutine raise_shared(scene, tie, n_facet, slave, master, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: n_facet(2)          !! or nodes, of the slave, of the master
      integer, intent(in) :: slave(:), master(:) !! their nodes, ascending
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: shared(size(slave))
      integer :: i, n, empty

      empty = 0
      if (n_facet(2) == 0) empty = tie%master
      if (n_facet(1) == 0) empty = tie%slave
      if (empty > 0) then
         call raise(error, err_input, tie_text(scene, tie) // "surface " // &
            scene%surface(empty)%name // " has no element faces; both surfaces of a tie need them")
         return
      end if
      n = 0
      do i = 1, size(slave)
         if (find_sorted(master, slave(i)) == 0) cycle
         n = n + 1
         shared(n)%text = to_text(scene%node%label(slave(i)))
      end do
      if (n == 0) return
      call raise(error, err_input, tie_text(scene, tie) // "slave surface " // &
         scene%surface(tie%slave)%name // " and master surface " // &
         scene%surface(tie%master)%name // " share nodes (" // &
         joined(shared(:n), ", ", most_named) // "); a tie joins meshes without common nodes")
   end subroutine raise_shared

   !> The position tolerance of a tie.
   pure function tolerance_text(tie, default_text) result(text)
      type(tie_t), intent(in) :: tie
      character(len=*), intent(in) :: default_text   !! where the deck gives none
      character(len=len(default_text) + 32) :: text      ! of a number the longest

      text = default_text
      if (tie%tolerance >= 0.0_wp) text = to_text(tie%tolerance)
   end function tolerance_text

end module emcon_tie_text
