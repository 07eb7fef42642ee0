!> Which of two surfaces should be the slave: the one whose edges see less of the other's shape.
!>
!> Source: docs/theory.md, section 4.12; docs/verification.md, a slave surface that is too coarse.
module emcon_deck_check_sides
   use emcon_deck_dimension, only : n_plane
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_surface_shape_plane, only : surface_shape, surface_shape_t
   use emcon_surface_shape_space, only : surface_size
   use emcon_text, only : to_text
   use emcon_wall, only : wall_breadth
   implicit none
   private
   public :: find_advice, advise_tie, advise_wall

   !> A slave surface longer than this times its master: force leaks where it reaches beyond. The
   !> rest is room for curved surfaces on straight ones.
   real(wp), parameter :: large_ratio = 1.25_wp
   !> Slave edges that see the master turn by more than this angle [degrees], and by this times as
   !> much as the other way round, push along the surface; those this times as long, at corners.
   real(wp), parameter :: coarse_ratio = 1.6_wp, seen_turn = 10.0_wp
   !> Surfaces whose edges see less of each other are flat to them [degrees].
   real(wp), parameter :: flat_turn = 5.0_wp

contains

   !> Why the slave of `pair` should be the master, to follow on its name; empty if it should not.
   subroutine find_advice(scene, pair, advice, is_bent)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(out) :: advice
      logical, intent(out) :: is_bent            !! because the slave sees its master turn
      type(surface_shape_t) :: slave, master
      real(wp) :: ratio, seen(2)

      advice = ""
      is_bent = .false.
      if (scene%n_dim /= n_plane) then
         call advise_space(scene, pair, advice)
         return
      end if
      slave = surface_shape(scene, scene%surface(pair%slave))
      master = surface_shape(scene, scene%surface(pair%master))
      if (master%length <= 0.0_wp .or. slave%length <= 0.0_wp) return
      ratio = min(slave%mean/master%mean, slave%shortest/master%shortest)
      seen = [ratio*master%turn, slave%turn/ratio]
      if (seen(2) > max(seen(1), flat_turn)) return
      is_bent = seen(1) > max(seen_turn, coarse_ratio*seen(2))
      associate (name => scene%surface(pair%master)%name)
         if (is_bent) then
            advice = " has edges along which master surface " // name // " turns by " &
               // to_text(seen(1), 3) // " degrees, which makes tangential forces wrong; the " &
               // "rounder one should be the slave"
         else if (slave%length > large_ratio*master%length) then
            if (coarse_ratio*slave%mean < master%mean) return
            advice = " is " // to_text(slave%length/master%length, 3) // " times as long as " &
               // "master surface " // name // "; the smaller one should be the slave"
         else if (ratio > coarse_ratio) then
            advice = " has edges " // to_text(ratio, 3) // " times as long as those of master " &
               // "surface " // name // ", which makes tangential forces at its corners wrong; " &
               // "the finer one should be the slave"
         end if
      end associate
   end subroutine find_advice

   !> The same in space, by the sizes of the surfaces and of their faces.
   subroutine advise_space(scene, pair, advice)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(inout) :: advice     !! "" stays where there is none
      real(wp) :: slave_area, slave_length, master_area, master_length

      call surface_size(scene, scene%surface(pair%slave), slave_area, slave_length)
      call surface_size(scene, scene%surface(pair%master), master_area, master_length)
      if (.not. min(slave_area, master_area) > 0.0_wp) return
      associate (name => scene%surface(pair%master)%name, ratio => slave_length/master_length, &
            share => slave_area/master_area)
         if (ratio > coarse_ratio) then
            advice = " has faces " // to_text(ratio, 3) // " times as long as those of master " &
               // "surface " // name // "; the finer one should be the slave"
         else if (share > large_ratio**2 .and. coarse_ratio*ratio >= 1.0_wp) then
            advice = " has " // to_text(share, 3) // " times the area of master surface " // name &
               // "; the smaller one should be the slave"
         end if
      end associate
   end subroutine advise_space

   !> Why the slave of a tie in space should be the master, to follow on its name; empty if it
   !> should not, or could not, as the master is larger.
   subroutine advise_tie(scene, slave, master, advice)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: slave, master       !! surfaces by their numbers
      character(len=:), allocatable, intent(out) :: advice
      real(wp) :: slave_area, slave_length, master_area, master_length

      advice = ""
      call surface_size(scene, scene%surface(slave), slave_area, slave_length)
      call surface_size(scene, scene%surface(master), master_area, master_length)
      if (.not. min(slave_area, master_area) > 0.0_wp) return
      if (slave_length <= coarse_ratio*master_length) return
      if (master_area > slave_area + 0.5_wp*slave_length*sqrt(slave_area)) return
      advice = " has faces " // to_text(slave_length/master_length, 3) // " times as long as " &
         // "those of master surface " // scene%surface(master)%name // ", which follow it in " &
         // "the mean only; the finer one should be the slave: swap the two"
   end subroutine advise_tie

   !> Why the slave of a pair whose master is a wall should be finer, to follow on its name; empty
   !> if it need not be. Nodes meet walls: what is between those of a face goes through it.
   subroutine advise_wall(scene, pair, advice)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(out) :: advice
      real(wp) :: area, length

      advice = ""
      associate (master => scene%surface(pair%master))
         if (.not. allocated(master%wall)) return
         call surface_size(scene, scene%surface(pair%slave), area, length)
         length = scale(length, exponent(maxval(abs(scene%x))))
         if (length <= wall_breadth(master%wall)) return
         advice = " has faces " // to_text(length, 3) // " long, and wall " // master%name &
            // " is " // to_text(wall_breadth(master%wall), 3) // " wide: walls stop nodes " &
            // "only, so that a wall between the nodes of a face passes through it unnoticed; " // &
            "take " &
            // "faces that are smaller than the wall"
      end associate
   end subroutine advise_wall

end module emcon_deck_check_sides
