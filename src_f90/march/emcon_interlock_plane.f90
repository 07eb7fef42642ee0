!> Polygons that slide over each other round a curve with friction: their corners catch.
!>
!> Where an edge leans by half the turn of a corner against the curve, its push has a part along
!> the curve. With edges about as long on both sides many do so at once, and the sum is told from
!> friction by nothing. Source: docs/theory.md, section 4.13.
module emcon_interlock_plane
   use emcon_coulomb_law, only : contact_slides
   use emcon_interactions, only : contact_options_t, interaction_friction, pair_acts, &
      smoothing_none
   use emcon_kinds, only : wp
   use emcon_march_types, only : increment_t, march_t
   use emcon_scene, only : scene_t
   use emcon_surface_shape_plane, only : surface_shape, surface_shape_t
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: interlock_tell

   !> So much of friction a push may have along the curve, and so much longer than those of the
   !> other polygon edges may be: longer ones lie on several corners, shorter ones follow it.
   real(wp), parameter :: told_part = 0.1_wp, most_longer = 3.0_wp
   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> A warning for each pair where it happens, the first time.
   subroutine interlock_tell(march, scene, increment)
      type(march_t), intent(inout) :: march
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(inout) :: increment
      real(wp) :: spread, turn, part
      integer :: pair

      if (.not. march%active%friction%is_on) return
      do pair = 1, size(scene%pair)
         associate (mu => interaction_friction(scene%pair(pair)%interaction, &
               march%state%clock%i_step), &
               knows => march%active%friction%knows_corners(pair))
            if (knows .or. .not. mu > 0.0_wp) cycle
            if (.not. pair_acts(scene%pair(pair), march%state%clock%i_step)) cycle
            spread = spread_of(march, pair)
            if (.not. spread > told_part*mu) cycle
            turn = turn_of(march, scene, pair)
            part = tan(0.5_wp*turn)/mu
            knows = .not. part > told_part
            if (knows .or. spread < 1.5_wp*turn) cycle
            knows = .true.
            call note_add(increment%warnings, trim(text_of(scene, pair, turn, part)))
         end associate
      end do
   end subroutine interlock_tell

   !> The largest angle between the pushes of contacts of a pair that slide and have left the edge
   !> where they began; 0 if there are less than three.
   pure real(wp) function spread_of(march, pair) result(spread)
      type(march_t), intent(in) :: march
      integer, intent(in) :: pair
      real(wp) :: first(2), push(2)
      integer :: k, n

      spread = 0.0_wp
      n = 0
      associate (set => march%active%set, friction => march%active%friction, &
            before => march%system%first_constraint)
         do k = set%n_permanent + 1, set%n
            associate (id => set%id(k), item => set%item(k))
               if (id <= before(pair) .or. id > before(pair + 1)) cycle
               if (friction%law(id)%status%kind /= contact_slides) cycle
               if (.not. march%state%contacts%slip_path(id) > item%size) cycle
               push = set%lam(k)*sum(item%c(:, :item%n_slave), 2)
            end associate
            n = n + 1
            if (n == 1) first = push
            spread = max(spread, abs(atan2(first(1)*push(2) - first(2)*push(1), &
               dot_product(first, push))))
         end do
      end associate
      if (n < 3) spread = 0.0_wp
   end function spread_of

   !> By how much the master polygon of a pair turns at its corners at most, where edges of the
   !> slave are about as long; 0 where curves take its place.
   pure real(wp) function turn_of(march, scene, pair) result(turn)
      type(march_t), intent(in) :: march
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      type(contact_options_t) :: options
      type(surface_shape_t) :: slave, master

      turn = 0.0_wp
      options = scene%step(march%state%clock%i_step)%contact%options
      if (scene%pair(pair)%has_options) options = scene%pair(pair)%options
      if (options%smoothing /= smoothing_none) return
      slave = surface_shape(scene, scene%surface(scene%pair(pair)%slave))
      master = surface_shape(scene, scene%surface(scene%pair(pair)%master))
      if (max(slave%mean, master%mean) > most_longer*min(slave%mean, master%mean)) return
      turn = master%turn*degree
   end function turn_of

   pure function text_of(scene, pair, turn, part) result(text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      real(wp), intent(in) :: turn               !! [radians]
      real(wp), intent(in) :: part               !! of friction
      character(len=400) :: text

      associate (surface => scene%surface)
         text = "corners of surfaces " // surface(scene%pair(pair)%slave)%name // " and " &
            // surface(scene%pair(pair)%master)%name // " catch on each other (edges turn by " &
            // to_text(turn/degree, 3) // " degrees at each): forces along the surface may be " &
            // "wrong by " // to_text(100.0_wp*part, 2) // " % of friction; " &
            // "*SURFACE SMOOTHING, TYPE=HERMITE or a surface of true arcs avoids it"
      end associate
   end function text_of

end module emcon_interlock_plane
